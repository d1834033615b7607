"""The operators of the profile: types, and how the shape of one sample follows from the inputs.

Every tensor is either constant or has the rows N as its first axis. A rule never lets rows mix
or multiply, so the cost of a network is a fixed number per row.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NoReturn

import numpy as np

from purelight_format.issues import fail
from purelight_format.limits import LIMITS

FLOAT, INT32, INT64, BOOL = (np.dtype(t) for t in (np.float32, np.int32, np.int64, np.bool_))
INDEX = (INT32, INT64)
NUMBER = (FLOAT, *INDEX)
ANY = (*NUMBER, BOOL)
TYPES = {1: FLOAT, 6: INT32, 7: INT64, 9: BOOL}  # By the numbers of ONNX's TensorProto.

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Tensor:
    """What is known of a value before it is computed.

    Arguments:
        dtype: element type.
        shape: of one sample; of the whole array for constants.
        value: content of a constant, None for everything that has rows.
    """

    dtype: np.dtype
    shape: Shape
    value: np.ndarray | None = None

    @cached_property
    def size(self) -> int:
        """Number of elements, per sample or of the constant."""
        return math.prod(self.shape)


@dataclass(frozen=True)
class Node:
    """An operator and its inputs.

    Arguments:
        op: name of the operator.
        where: the location that issues name.
        inputs: None for one left out.
        attributes: by name.
        outputs: how many outputs are named.
    """

    op: str
    where: str
    inputs: tuple[Tensor | None, ...]
    attributes: dict[str, Any]
    outputs: int

    def bad_shape(self, what: str) -> NoReturn:
        fail("PLX_ONNX_SHAPE", self.where, op=self.op, what=what)

    def bad_type(self, what: str) -> NoReturn:
        fail("PLX_ONNX_TYPE", self.where, op=self.op, what=what)

    def rows(self, index: int = 0) -> Tensor:
        """An input that must have rows."""
        tensor = self.inputs[index]
        if tensor is None or tensor.value is not None:
            self.bad_shape(f"input {index} must depend on the network's inputs")
        return tensor

    def constant(self, index: int, dtypes: tuple[np.dtype, ...]) -> np.ndarray:
        """The value of an input that must be an initializer."""
        tensor = self.inputs[index] if index < len(self.inputs) else None
        if tensor is None or tensor.value is None:
            self.bad_shape(f"input {index} must be an initializer")
        if tensor.dtype not in dtypes:
            self.bad_type(f"input {index} is {tensor.dtype}")
        return tensor.value

    def numbers(self, index: int, dtypes: tuple[np.dtype, ...] = (INT64,)) -> list[int]:
        """The numbers of an input that must be a one-dimensional initializer."""
        value = self.constant(index, dtypes)
        if value.ndim != 1 or value.size > LIMITS.node_outputs:
            self.bad_shape(f"input {index} must be a short list")
        return [int(number) for number in value]

    def axes(self, index: int, rank: int) -> list[int]:
        """Axes given as an initializer, counted without the rows; never the rows, none twice."""
        axes = [self.axis(axis, rank) for axis in self.numbers(index)]
        if len(set(axes)) != len(axes):
            self.bad_shape("an axis is named twice")
        return axes

    def axis(self, axis: int, rank: int) -> int:
        """An axis of a tensor of `rank` axes besides the rows, counted without the rows."""
        if not -rank - 1 <= axis <= rank:
            self.bad_shape(f"axis {axis} does not exist")
        axis = axis % (rank + 1)
        if axis == 0:
            self.bad_shape("the rows may not be mixed")
        return axis - 1


Rule = Callable[[Node], list[Tensor]]


@dataclass(frozen=True)
class Operator:
    """An entry of the allow-list.

    Arguments:
        rule: gives the outputs.
        least, most: numbers of inputs.
        attributes: allowed names.
    """

    rule: Rule
    least: int = 1
    most: int = 1
    attributes: tuple[str, ...] = ()


# Elementwise operators


def _broadcast(node: Node, inputs: tuple[Tensor, ...]) -> Shape:
    """Shape of a sample when constants and tensors of equal rank are broadcast."""
    ranks = {len(tensor.shape) for tensor in inputs if tensor.value is None}
    if len(ranks) > 1:
        node.bad_shape("tensors with rows must have the same number of axes")
    rank = ranks.pop()
    shapes = [t.shape if t.value is None else _without_rows(node, t.shape, rank) for t in inputs]
    if len(set(shapes)) == 1:
        return shapes[0]
    try:
        return np.broadcast_shapes(*shapes)
    except ValueError:
        node.bad_shape(f"{' and '.join(map(str, shapes))} do not fit")


def _without_rows(node: Node, shape: Shape, rank: int) -> Shape:
    if len(shape) > rank and (len(shape) > rank + 1 or shape[0] != 1):
        node.bad_shape(f"a constant of shape {shape} would be spread over the rows")
    return shape[1:] if len(shape) > rank else shape


def _given(node: Node) -> tuple[Tensor, ...]:
    if any(tensor is None for tensor in node.inputs):
        node.bad_shape("an input is missing")
    return tuple(tensor for tensor in node.inputs if tensor is not None)


def _elementwise(dtypes: tuple[np.dtype, ...], result: np.dtype | None = None) -> Rule:
    """Inputs of one type, broadcast; the result has that type or the one given."""

    def rule(node: Node) -> list[Tensor]:
        inputs = _given(node)
        _require_one_type(node, inputs, dtypes)
        return [Tensor(result or inputs[0].dtype, _broadcast(node, inputs))]

    return rule


def _require_one_type(node: Node, inputs: tuple[Tensor, ...], dtypes: tuple[np.dtype, ...]) -> None:
    found = {tensor.dtype for tensor in inputs}
    if len(found) > 1 or not found <= set(dtypes):
        node.bad_type(f"inputs are {', '.join(str(t.dtype) for t in inputs)}")


def _cast(node: Node) -> list[Tensor]:
    to = node.attributes.get("to")
    if to not in TYPES:
        node.bad_type(f"cannot convert to element type {to}")
    return [Tensor(TYPES[to], node.rows().shape)]


def _clip(node: Node) -> list[Tensor]:
    x = node.rows()
    if x.dtype not in NUMBER:
        node.bad_type(f"the input is {x.dtype}")
    for index in range(1, len(node.inputs)):
        if node.inputs[index] is not None and node.constant(index, (x.dtype,)).ndim:
            node.bad_shape("bounds must be scalars")
    return [x]


def _div(node: Node) -> list[Tensor]:
    _require_divisor(node)
    return _elementwise(NUMBER)(node)


def _mod(node: Node) -> list[Tensor]:
    integers = node.attributes.get("fmod", 0) == 0
    _require_divisor(node)
    return _elementwise(INDEX if integers else (FLOAT,))(node)


def _require_divisor(node: Node) -> None:
    """Integers are divided by positive constants; hardware traps 0, and the least by -1."""
    if _given(node)[0].dtype in INDEX and node.constant(1, INDEX).min() < 1:
        node.bad_type("integers may only be divided by positive numbers")


def _where(node: Node) -> list[Tensor]:
    inputs = _given(node)
    if inputs[0].dtype != BOOL:
        node.bad_type("the condition is not bool")
    _require_one_type(node, inputs[1:], NUMBER)
    return [Tensor(inputs[1].dtype, _broadcast(node, inputs))]


# Products and sums


def _gemm(node: Node) -> list[Tensor]:
    x = node.rows()
    weight, bias = node.constant(1, (FLOAT,)), node.constant(2, (FLOAT,))
    fixed = {"transB": 1, "transA": 0, "alpha": 1.0, "beta": 1.0}
    if {**fixed, "transB": 0, **node.attributes} != fixed:
        node.bad_shape("must be x weight' + bias (transB 1, no other factor)")
    if x.dtype != FLOAT:
        node.bad_type(f"the input is {x.dtype}")
    if weight.ndim != 2 or x.shape != weight.shape[1:] or bias.shape != weight.shape[:1]:
        node.bad_shape(f"input {x.shape}, weight {weight.shape} and bias {bias.shape} do not fit")
    return [Tensor(FLOAT, weight.shape[:1])]


def _matmul(node: Node) -> list[Tensor]:
    x, weight = node.rows(), node.constant(1, (FLOAT,))
    if x.dtype != FLOAT:
        node.bad_type(f"the input is {x.dtype}")
    if weight.ndim != 2 or x.shape != weight.shape[:1]:
        node.bad_shape(f"input {x.shape} and weight {weight.shape} do not fit")
    return [Tensor(FLOAT, weight.shape[1:])]


def _reduce(node: Node) -> list[Tensor]:
    x = node.rows()
    if x.dtype not in NUMBER:
        node.bad_type(f"the input is {x.dtype}")
    axes = node.axes(1, len(x.shape))
    if not axes or node.attributes.get("noop_with_empty_axes", 0):
        node.bad_shape("axes must be given")
    keep = node.attributes.get("keepdims", 1)
    sizes = [1 if k in axes else size for k, size in enumerate(x.shape) if keep or k not in axes]
    return [Tensor(x.dtype, tuple(sizes))]


def _cumsum(node: Node) -> list[Tensor]:
    x, axis = node.rows(), node.constant(1, INDEX)
    if x.dtype not in NUMBER:
        node.bad_type(f"the input is {x.dtype}")
    if axis.ndim:
        node.bad_shape("the axis must be a scalar")
    node.axis(int(axis), len(x.shape))
    return [x]


def _softmax(node: Node) -> list[Tensor]:
    x = node.rows()
    if x.dtype != FLOAT:
        node.bad_type(f"the input is {x.dtype}")
    node.axis(node.attributes.get("axis", -1), len(x.shape))
    return [x]


# Selection and arrangement


def _gather(node: Node) -> list[Tensor]:
    """Rows of a constant table by computed indices, or constant columns of computed rows."""
    data, index = _given(node)
    axis = node.attributes.get("axis", 0)
    if index.dtype not in INDEX:
        node.bad_type(f"the index is {index.dtype}")
    if data.value is not None and index.value is None:
        if axis != 0 or not data.shape:
            node.bad_shape("a table is read along its first axis")
        return [Tensor(data.dtype, index.shape + data.shape[1:])]
    columns = node.constant(1, INDEX)
    axis = node.axis(axis, len(data.shape))
    size = data.shape[axis]
    if columns.size and not -size <= columns.min() <= columns.max() < size:
        node.bad_shape("an index is out of range")
    return [Tensor(data.dtype, data.shape[:axis] + columns.shape + data.shape[axis + 1 :])]


def _gather_elements(node: Node) -> list[Tensor]:
    x, index = node.rows(0), node.rows(1)
    if index.dtype not in INDEX:
        node.bad_type(f"the index is {index.dtype}")
    axis = node.axis(node.attributes.get("axis", 0), len(x.shape))
    fits = len(index.shape) == len(x.shape) and all(
        k == axis or size == x.shape[k] for k, size in enumerate(index.shape)
    )
    if not fits:
        node.bad_shape(f"index {index.shape} does not fit {x.shape}")
    return [Tensor(x.dtype, index.shape)]


def _concat(node: Node) -> list[Tensor]:
    inputs = [node.rows(k) for k in range(len(node.inputs))]
    _require_one_type(node, tuple(inputs), ANY)
    first = inputs[0].shape
    axis = node.axis(node.attributes.get("axis", 0), len(first))
    others = {t.shape[:axis] + t.shape[axis + 1 :] for t in inputs if len(t.shape) == len(first)}
    if len(others) != 1 or any(len(t.shape) != len(first) for t in inputs):
        node.bad_shape("the inputs do not fit")
    width = sum(tensor.shape[axis] for tensor in inputs)
    return [Tensor(inputs[0].dtype, (*first[:axis], width, *first[axis + 1 :]))]


def _split(node: Node) -> list[Tensor]:
    x, sizes = node.rows(), node.numbers(1)
    axis = node.axis(node.attributes.get("axis", 0), len(x.shape))
    if min(sizes, default=0) < 1 or sum(sizes) != x.shape[axis] or len(sizes) != node.outputs:
        node.bad_shape(f"sizes {sizes} do not make up {x.shape[axis]}")
    return [Tensor(x.dtype, (*x.shape[:axis], size, *x.shape[axis + 1 :])) for size in sizes]


def _slice(node: Node) -> list[Tensor]:
    x = node.rows()
    shape = list(x.shape)
    starts, ends, axes = node.numbers(1), node.numbers(2), node.axes(3, len(shape))
    steps = node.numbers(4) if len(node.inputs) > 4 else [1] * len(axes)
    if not len(starts) == len(ends) == len(axes) == len(steps):
        node.bad_shape("starts, ends, axes and steps do not fit")
    for start, end, axis, step in zip(starts, ends, axes, steps, strict=True):
        if step < 1:
            node.bad_shape("steps must be positive")
        shape[axis] = len(range(*slice(start, end, step).indices(shape[axis])))
    return [Tensor(x.dtype, tuple(shape))]


def _reshape(node: Node) -> list[Tensor]:
    x, target = node.rows(), node.numbers(1)
    if node.attributes.get("allowzero", 0) or target[:1] not in ([-1], [0]):
        node.bad_shape("the first size must stand for the rows (-1)")
    if min(target[1:], default=1) < 1 or math.prod(target[1:]) != x.size:
        node.bad_shape(f"a row of {x.shape} cannot become {target[1:]}")
    return [Tensor(x.dtype, tuple(target[1:]))]


def _transpose(node: Node) -> list[Tensor]:
    x, order = node.rows(), node.attributes.get("perm", [])
    if sorted(order) != list(range(len(x.shape) + 1)) or order[0] != 0:
        node.bad_shape(f"order {order} is none that leaves the rows in front")
    return [Tensor(x.dtype, tuple(x.shape[k - 1] for k in order[1:]))]


def _squeeze(node: Node) -> list[Tensor]:
    x = node.rows()
    axes = node.axes(1, len(x.shape))
    if any(x.shape[axis] != 1 for axis in axes):
        node.bad_shape(f"axes {sorted(axes)} of {x.shape} are not all 1")
    return [Tensor(x.dtype, tuple(s for k, s in enumerate(x.shape) if k not in axes))]


def _unsqueeze(node: Node) -> list[Tensor]:
    x = node.rows()
    count = len(node.numbers(1))
    axes = node.axes(1, len(x.shape) + count)
    sizes = iter(x.shape)
    rank = len(x.shape) + count
    return [Tensor(x.dtype, tuple(1 if k in axes else next(sizes) for k in range(rank)))]


# The allow-list

_FLOATS = _elementwise((FLOAT,))
_NUMBERS = _elementwise(NUMBER)
_COMPARISON = _elementwise(NUMBER, BOOL)
_LOGIC = _elementwise((BOOL,))
_MANY = LIMITS.node_inputs

OPERATORS = {
    **dict.fromkeys(
        ("Asin", "Atan", "Cos", "Exp", "Floor", "Log", "Reciprocal", "Relu", "Sigmoid", "Sin",
         "Sqrt"), Operator(_FLOATS)),
    **dict.fromkeys(("Abs", "Neg", "Sign"), Operator(_NUMBERS)),
    **dict.fromkeys(("Add", "Mul", "Sub"), Operator(_NUMBERS, 2, 2)),
    "Div": Operator(_div, 2, 2),
    **dict.fromkeys(("Max", "Min"), Operator(_NUMBERS, 1, _MANY)),
    **dict.fromkeys(
        ("Greater", "GreaterOrEqual", "Less", "LessOrEqual"), Operator(_COMPARISON, 2, 2)),
    **dict.fromkeys(("And", "Or"), Operator(_LOGIC, 2, 2)),
    **dict.fromkeys(("ReduceMax", "ReduceSum"),
                    Operator(_reduce, 2, 2, ("keepdims", "noop_with_empty_axes"))),
    "Cast": Operator(_cast, attributes=("to",)),
    "Clip": Operator(_clip, 1, 3),
    "Concat": Operator(_concat, 1, _MANY, ("axis",)),
    "CumSum": Operator(_cumsum, 2, 2, ("exclusive", "reverse")),
    "Equal": Operator(_elementwise(ANY, BOOL), 2, 2),
    "Gather": Operator(_gather, 2, 2, ("axis",)),
    "GatherElements": Operator(_gather_elements, 2, 2, ("axis",)),
    "Gemm": Operator(_gemm, 3, 3, ("alpha", "beta", "transA", "transB")),
    "Identity": Operator(_elementwise(ANY)),
    "MatMul": Operator(_matmul, 2, 2),
    "Mod": Operator(_mod, 2, 2, ("fmod",)),
    "Not": Operator(_LOGIC),
    "Reshape": Operator(_reshape, 2, 2, ("allowzero",)),
    "Slice": Operator(_slice, 4, 5),
    "Softmax": Operator(_softmax, attributes=("axis",)),
    "Split": Operator(_split, 2, 2, ("axis",)),
    "Squeeze": Operator(_squeeze, 2, 2),
    "Transpose": Operator(_transpose, attributes=("perm",)),
    "Unsqueeze": Operator(_unsqueeze, 2, 2),
    "Where": Operator(_where, 3, 3),
}  # fmt: skip
