"""The reference evaluator of the ONNX profile: NumPy, float64 or float32, no runtime involved."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence, Set
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks import denormals
from purelight_format.networks.model import load
from purelight_format.networks.operators import TYPES, Shape
from purelight_format.networks.profile import NetworkCost, foretell

Array = np.ndarray
FLOAT = 1  # Number of float32 among ONNX's element types.
ROWS, ELEMENTS = 1024, 1 << 24  # At a time, so that a network at every limit fits into 256 MiB.
SHORT = 32  # Axes of so few elements are reduced one slice after the other.


def evaluate(
    model: bytes,
    inputs: Mapping[str, Array],
    dtype: Any = np.float64,
    cost: NetworkCost | None = None,
) -> dict[str, Array]:
    """Evaluates a vetted network, a few rows at a time.

    Arguments:
        model: ONNX bytes of the profile.
        inputs: by name, [N, ...].
        dtype: the type that stands for float32 in weights, inputs and intermediates.
        cost: what `inspect` found, if it was asked before.

    Returns:
        The outputs by name, [N, ...] in `dtype`.

    Raises:
        PureLightError: If the network is not of the profile, or an index leaves its table.
    """
    graph = load(model).graph
    rows = {name: np.asarray(array, dtype) for name, array in inputs.items()}
    shapes, floats = (
        _foretold(graph, rows) if cost is None else (cost.shapes, cost.floats_per_sample)
    )
    constants = {t.name: _constant(t, dtype) for t in graph.initializer}
    count, step = max(map(len, rows.values())), max(1, min(ROWS, ELEMENTS // max(floats, 1)))
    parts = [
        _evaluate(graph, constants, {k: v[i : i + step] for k, v in rows.items()}, dtype, shapes)
        for i in range(0, max(count, 1), step)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _foretold(graph: Any, rows: Mapping[str, Array]) -> tuple[Mapping[str, Shape], int]:
    """Sizes of one row of every value, and their sum."""
    values, (_, floats, _) = foretell(graph, {k: v.shape[1:] for k, v in rows.items()})
    return {name: tensor.shape for name, tensor in values.items()}, floats


def _evaluate(
    graph: Any,
    constants: dict[str, Array],
    inputs: dict[str, Array],
    dtype: Any,
    shapes: Mapping[str, Shape],
) -> dict[str, Array]:
    values, rows = constants | inputs, len(next(iter(inputs.values())))
    wanted = [value.name for value in graph.output]
    with np.errstate(all="ignore"), denormals.flushed():
        for node, unread in zip(graph.node, _unread(graph, {*wanted, ""}), strict=True):
            results = _run(node, [values[name] if name else None for name in node.input], dtype)
            for name, result in zip(node.output, results, strict=True):
                if result.shape != (rows, *shapes[name]):
                    raise PureLightError(f"{node.op_type}: a result of {result.shape}")
                values[name] = result
            for name in unread:
                del values[name]
    return {name: values[name] for name in wanted}


def _unread(graph: Any, wanted: Set[str]) -> list[list[str]]:
    """For each node, the values that no later one reads."""
    last = {name: k for k, node in enumerate(graph.node) for name in (*node.output, *node.input)}
    ending: list[list[str]] = [[] for _ in graph.node]
    for name, k in last.items():
        if name not in wanted:
            ending[k].append(name)
    return ending


def _constant(tensor: Any, dtype: Any) -> Array:
    kind = TYPES[tensor.data_type]
    array = np.frombuffer(tensor.raw_data, kind.newbyteorder("<")).reshape(tuple(tensor.dims))
    return array.astype(dtype if tensor.data_type == FLOAT else kind)


def _run(node: Any, inputs: Sequence[Array | None], dtype: Any) -> list[Array]:
    if node.op_type not in OPERATORS:
        raise PureLightError(f"the operator {node.op_type} is not in the ONNX profile")
    attributes = {a.name: _attribute(a) for a in node.attribute}
    if node.op_type == "Cast":
        attributes["dtype"] = dtype
    try:
        result = OPERATORS[node.op_type](*inputs, **attributes)
    except IndexError as error:
        raise PureLightError(f"{node.op_type}: {error}; the network is broken") from error
    return list(result) if isinstance(result, list) else [result]


def _attribute(attribute: Any) -> Any:
    return {1: attribute.f, 2: attribute.i, 7: list(attribute.ints)}[attribute.type]


def _cast(x: Array, to: int, dtype: Any) -> Array:
    return x.astype(dtype if to == FLOAT else TYPES[to])


def _clip(x: Array, low: Array | None = None, high: Array | None = None) -> Array:
    x = x if low is None else np.maximum(x, low)
    return x if high is None else np.minimum(x, high)


def _concat(*inputs: Array, axis: int) -> Array:
    return np.concatenate(inputs, axis)


def _cumsum(x: Array, axis: Array, exclusive: int = 0, reverse: int = 0) -> Array:
    x = np.moveaxis(x, int(axis), -1)
    x = x[..., ::-1] if reverse else x
    sums = np.cumsum(x, -1, dtype=x.dtype)
    if exclusive:
        sums = np.concatenate((np.zeros_like(sums[..., :1]), sums[..., :-1]), -1)
    sums = sums[..., ::-1] if reverse else sums
    return np.moveaxis(sums, -1, int(axis))


def _div(a: Array, b: Array) -> Array:
    if a.dtype.kind == "f":
        return a / b
    return np.sign(a) * np.sign(b) * (np.abs(a) // np.abs(b))  # Integers truncate towards zero.


def _gather(data: Array, index: Array, axis: int = 0) -> Array:
    return np.take(data, index, axis)


def _gather_elements(data: Array, index: Array, axis: int = 0) -> Array:
    return np.take_along_axis(data, index, axis)


def _gemm(x: Array, weight: Array, bias: Array, transB: int, **_: float) -> Array:
    return x @ weight.T + bias


def _mod(a: Array, b: Array, fmod: int = 0) -> Array:
    return np.fmod(a, b) if fmod else np.mod(a, b)


def _reduce(function: Any) -> Callable[..., Array]:
    def run(x: Array, axes: Array, keepdims: int = 1, noop_with_empty_axes: int = 0) -> Array:
        if len(axes) == 1 and x.shape[axes[0]] <= SHORT:  # Else a loop for each of its results.
            result = functools.reduce(function, np.moveaxis(x, axes[0], 0))
            return np.expand_dims(result, axes[0]) if keepdims else result
        return function.reduce(x, axis=tuple(axes.tolist()), keepdims=bool(keepdims))

    return run


def _sigmoid(x: Array) -> Array:
    small = np.exp(-np.abs(x))
    return np.where(x >= 0, 1, small) / (1 + small)


def _slice(x: Array, starts: Array, ends: Array, axes: Array, steps: Array | None = None) -> Array:
    steps = np.ones_like(starts) if steps is None else steps
    window = [slice(None)] * x.ndim
    for start, end, axis, step in zip(starts, ends, axes, steps, strict=True):
        window[axis] = slice(int(start), int(end), int(step))
    return x[tuple(window)]


def _softmax(x: Array, axis: int = -1) -> Array:
    e = np.exp(x - x.max(axis, keepdims=True, initial=-np.inf))
    return e / e.sum(axis, keepdims=True)


def _split(x: Array, sizes: Array, axis: int = 0) -> list[Array]:
    return np.split(x, np.cumsum(sizes)[:-1], axis)


def _reshape(x: Array, shape: Array, allowzero: int = 0) -> Array:
    return x.reshape(len(x), *shape.tolist()[1:])


def _transpose(x: Array, perm: list[int]) -> Array:
    return np.transpose(x, perm)


def _variadic(function: Any) -> Callable[..., Array]:
    def run(first: Array, *others: Array) -> Array:
        for other in others:
            first = function(first, other)
        return first

    return run


OPERATORS: dict[str, Callable[..., Any]] = {
    "Abs": np.abs, "Add": np.add, "And": np.logical_and, "Asin": np.arcsin, "Atan": np.arctan,
    "Cast": _cast, "Clip": _clip, "Concat": _concat, "Cos": np.cos, "CumSum": _cumsum,
    "Div": _div, "Equal": np.equal, "Exp": np.exp, "Floor": np.floor, "Gather": _gather,
    "GatherElements": _gather_elements, "Gemm": _gemm, "Greater": np.greater,
    "GreaterOrEqual": np.greater_equal, "Identity": lambda x: x, "Less": np.less,
    "LessOrEqual": np.less_equal, "Log": np.log, "MatMul": np.matmul,
    "Max": _variadic(np.maximum), "Min": _variadic(np.minimum), "Mod": _mod, "Mul": np.multiply,
    "Neg": np.negative, "Not": np.logical_not, "Or": np.logical_or,
    "Reciprocal": lambda x: 1 / x, "ReduceMax": _reduce(np.maximum), "ReduceSum": _reduce(np.add),
    "Relu": lambda x: np.maximum(x, 0), "Reshape": _reshape, "Sigmoid": _sigmoid,
    "Sign": np.sign, "Sin": np.sin, "Slice": _slice, "Softmax": _softmax, "Split": _split,
    "Sqrt": np.sqrt, "Squeeze": lambda x, axes: np.squeeze(x, tuple(axes.tolist())),
    "Sub": np.subtract, "Transpose": _transpose,
    "Unsqueeze": lambda x, axes: np.expand_dims(x, tuple(axes.tolist())), "Where": np.where,
}  # fmt: skip
