"""The operators of the ONNX profile as Dr.Jit arithmetic, one scalar per column of a row.

A tensor [N, *shape] is a NumPy object array of that shape whose elements are Dr.Jit scalars, so
that everything which only moves columns is NumPy. A constant is an ordinary NumPy array.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial, reduce
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError

Tensor = np.ndarray
Attributes = dict[str, Any]
Operator = Callable[..., Any]

FLOAT, INT32, INT64, BOOL = 1, 6, 7, 9  # ONNX's numbers for element types.
VAST = 2.0**24  # From here on a float32 is more than one from the next (N13).


def row(elements: list[Any]) -> Tensor:
    """Returns Dr.Jit scalars as a tensor [N, D]; NumPy must not look inside them."""
    result = np.empty(len(elements), object)
    for index, element in enumerate(elements):
        result[index] = element
    return result


def elementwise(function: Callable[..., Any], *tensors: Tensor, **_: Any) -> Tensor:
    """Applies a function to every element, broadcasting columns as ONNX does."""
    rank = max(t.ndim for t in tensors if t.dtype == object)
    operands = [_aligned(tensor, rank) for tensor in tensors]
    # Every pass traces its networks anew, so this must be quick: most operands have one shape.
    if len({operand.shape for operand in operands}) > 1:
        operands = list(np.broadcast_arrays(*operands))
    columns = (operand.ravel().tolist() for operand in operands)
    return row(list(map(function, *columns))).reshape(operands[0].shape)


def _aligned(tensor: Tensor, rank: int) -> Tensor:
    """Gives constants typed literals as elements and takes away an axis that stands for rows."""
    if tensor.dtype == object:
        return tensor
    kind = literal_type(tensor.dtype)
    literals = row([kind(value) for value in tensor.ravel().tolist()]).reshape(tensor.shape)
    return literals[0] if literals.ndim > rank else literals


def literal_type(dtype: np.dtype) -> Any:
    """Returns the Dr.Jit type of a NumPy one; ONNX constants have no others."""
    return {"f4": mi.Float, "i4": mi.Int, "i8": mi.Int64, "b1": mi.Bool}[dtype.str[1:]]


def _divide(a: Any, b: Any) -> Any:
    return a / b if dr.is_float_v(a) else a // b


def _wave(function: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Sine or cosine; 0 of `VAST` angles, of which Dr.Jit's are as vast or infinite."""

    def bounded(x: Any) -> Any:
        size = dr.abs(x)
        return dr.select((size >= VAST) & (size < dr.inf), 0, function(x))

    return bounded


def _remainder(a: Any, b: Any, *, fmod: int = 0) -> Any:
    """Remainder with the sign of the divisor, or with the dividend's (fmod) as Dr.Jit's has."""
    if fmod:
        return dr.select(dr.abs(a) < dr.abs(b), a, _rest(a, b))
    rest = a % b
    return dr.select((rest != 0) & ((rest < 0) != (b < 0)), rest + b, rest)


def _rest(a: Any, b: Any) -> Any:
    """Remainder of what is no less than its divisor; 0 where the quotient is `VAST`."""
    rest = dr.fma(-dr.trunc(a / b), b, a)  # The quotient may be rounded up to a whole number.
    found = dr.select(rest * a < 0, rest + dr.copysign(b, a), rest)
    return dr.select(dr.abs(found) >= dr.abs(b), 0, found)


def _sign(x: Any) -> Any:
    return dr.select(x > 0, type(x)(1), dr.select(x < 0, type(x)(-1), type(x)(0)))


def _cast(x: Any, *, to: int) -> Any:
    if to == BOOL:
        return x if dr.is_mask_v(x) else x != 0
    kind = {FLOAT: mi.Float, INT32: mi.Int, INT64: mi.Int64}[to]
    return dr.select(x, kind(1), kind(0)) if dr.is_mask_v(x) else kind(x)


def from_start(index: Any, size: int) -> Any:
    """An index that counts from behind where it is negative, as ONNX has it."""
    return dr.select(index < 0, index + size, index)


def _each(function: Callable[..., Any]) -> Operator:
    """An operator that applies a function of its operands and attributes to every element."""

    def operator(*tensors: Tensor, **attributes: Any) -> Tensor:
        return elementwise(partial(function, **attributes), *tensors)

    return operator


def _many(function: Callable[[Any, Any], Any]) -> Operator:
    """An elementwise operator of any number of operands, which may change places."""

    def operator(*tensors: Tensor) -> Tensor:
        rows_first = sorted(tensors, key=lambda tensor: tensor.dtype != object)
        return reduce(partial(elementwise, function), rows_first)

    return operator


def _clip(x: Tensor, low: Tensor | None = None, high: Tensor | None = None) -> Tensor:
    if low is not None:
        x = elementwise(dr.maximum, x, low)
    return x if high is None else elementwise(dr.minimum, x, high)


# Along the columns


def _axis(axis: int, tensor: Tensor) -> int:
    """Returns an axis of the tensor that counts rows as one of the array that does not."""
    axis = axis + tensor.ndim if axis < 0 else axis - 1
    if not 0 <= axis < tensor.ndim:
        raise PureLightError(f"a network works along axis {axis + 1}, which would mix its rows")
    return axis


def _reduce(function: Callable[[Any, Any], Any]) -> Operator:
    def operator(x: Tensor, axes: Tensor, *, keepdims: int = 1, **_: Any) -> Tensor:
        for axis in sorted((_axis(int(a), x) for a in axes), reverse=True):
            parts = np.split(x, x.shape[axis], axis)
            x = reduce(partial(elementwise, function), parts)
            x = x if keepdims else np.squeeze(x, axis)
        return x

    return operator


def _softmax(x: Tensor, *, axis: int = -1) -> Tensor:
    axes = np.array([axis])
    shifted = elementwise(lambda a, b: dr.exp(a - b), x, _reduce(dr.maximum)(x, axes))
    total = _reduce(lambda a, b: a + b)(shifted, axes)
    inverse = elementwise(lambda a: 1 / a, total)
    return elementwise(lambda a, b: a * b, shifted, inverse)


def _cumulative_sum(x: Tensor, axis: Tensor, *, exclusive: int = 0, reverse: int = 0) -> Tensor:
    along = _axis(axis.item(), x)
    parts = np.split(x, x.shape[along], along)[:: -1 if reverse else 1]
    sums = [parts[0]]
    for part in parts[1:]:
        sums.append(elementwise(lambda a, b: a + b, sums[-1], part))
    if exclusive:
        sums = [elementwise(lambda a: a * 0, parts[0]), *sums[:-1]]
    return np.concatenate(sums[:: -1 if reverse else 1], along)


def _concat(*tensors: Tensor, axis: int) -> Tensor:
    return np.concatenate(tensors, _axis(axis, tensors[0]))


def _split(
    x: Tensor, sizes: Tensor | None = None, *, axis: int = 0, num_outputs: int = 0
) -> list[Tensor]:
    along = _axis(axis, x)
    if sizes is None:
        step = -(-x.shape[along] // num_outputs)
        return np.split(x, range(step, x.shape[along], step), along)
    return np.split(x, np.cumsum(sizes)[:-1], along)


def _slice(
    x: Tensor, starts: Tensor, ends: Tensor, axes: Tensor | None = None, steps: Tensor | None = None
) -> Tensor:
    axes = np.arange(len(starts)) if axes is None else axes
    steps = np.ones_like(starts) if steps is None else steps
    for start, end, axis, step in zip(starts, ends, axes, steps, strict=True):
        along = _axis(axis.item(), x)
        index = slice(int(start), int(end), int(step))
        x = x[(slice(None),) * along + (index,)]
    return x


def _gather(data: Tensor, index: Tensor, *, axis: int = 0) -> Tensor:
    if data.dtype == object and index.dtype != object:
        return np.take(data, index, _axis(axis, data))
    raise PureLightError("a network looks up a table that is not one of its constants")


def _gather_elements(x: Tensor, index: Tensor, *, axis: int = 0) -> Tensor:
    along = _axis(axis, x)

    def pick(i: Any, *columns: Any) -> Any:
        place, found = from_start(i, len(columns)), columns[0]
        for k in range(1, len(columns)):
            found = dr.select(place == k, columns[k], found)
        return found

    return elementwise(pick, index, *np.split(x, x.shape[along], along))


def _reshape(x: Tensor, shape: Tensor, **_: Any) -> Tensor:
    return x.reshape([int(size) for size in shape[1:]])


def _transpose(x: Tensor, *, perm: list[int]) -> Tensor:
    if perm[0] != 0:
        raise PureLightError("a network moves its rows to another axis")
    return x.transpose([axis - 1 for axis in perm[1:]])


def _squeeze(x: Tensor, axes: Tensor) -> Tensor:
    return np.squeeze(x, tuple(_axis(int(axis), x) for axis in axes))


def _unsqueeze(x: Tensor, axes: Tensor) -> Tensor:
    rank = x.ndim + 1 + len(axes)
    return np.expand_dims(x, tuple(int(axis) % rank - 1 for axis in axes))


OPERATORS: dict[str, Operator] = {
    "Abs": _each(dr.abs),
    "Add": _each(lambda a, b: a + b),
    "And": _each(lambda a, b: a & b),
    "Asin": _each(dr.asin),
    "Atan": _each(dr.atan),
    "Cast": _each(_cast),
    "Clip": _clip,
    "Concat": _concat,
    "Cos": _each(_wave(dr.cos)),
    "CumSum": _cumulative_sum,
    "Div": _each(_divide),
    "Equal": _each(lambda a, b: a == b),
    "Exp": _each(dr.exp),
    "Floor": _each(dr.floor),
    "Gather": _gather,
    "GatherElements": _gather_elements,
    "Greater": _each(lambda a, b: a > b),
    "GreaterOrEqual": _each(lambda a, b: a >= b),
    "Identity": lambda x: x,
    "Less": _each(lambda a, b: a < b),
    "LessOrEqual": _each(lambda a, b: a <= b),
    "Log": _each(dr.log),
    "Max": _many(dr.maximum),
    "Min": _many(dr.minimum),
    "Mod": _each(_remainder),
    "Mul": _each(lambda a, b: a * b),
    "Neg": _each(lambda a: -a),
    "Not": _each(lambda a: ~a),
    "Or": _each(lambda a, b: a | b),
    "Reciprocal": _each(lambda a: 1 / a),
    "ReduceMax": _reduce(dr.maximum),
    "ReduceSum": _reduce(lambda a, b: a + b),
    "Relu": _each(lambda a: dr.maximum(a, 0)),
    "Reshape": _reshape,
    "Sigmoid": _each(lambda a: 1 / (1 + dr.exp(-a))),
    "Sign": _each(_sign),
    "Sin": _each(_wave(dr.sin)),
    "Slice": _slice,
    "Softmax": _softmax,
    "Split": _split,
    "Sqrt": _each(dr.sqrt),
    "Squeeze": _squeeze,
    "Sub": _each(lambda a, b: a - b),
    "Transpose": _transpose,
    "Unsqueeze": _unsqueeze,
    "Where": _each(dr.select),
}
