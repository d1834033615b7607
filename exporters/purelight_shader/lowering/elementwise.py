"""Operators that work element by element."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from purelight_format.networks.operators import BOOL, FLOAT, INT32, TYPES
from purelight_shader.form.elements import Call, Expression, Kind, Number
from purelight_shader.lowering import bounds, value
from purelight_shader.lowering.bounds import INT_MOST, LONG_MOST, Bounds
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer

WRAPPING = ("add", "sub", "mul")  # What may leave the range of int32 on purpose, as hashes do.
LARGEST_FLOATS = {Kind.INT: 2147483520.0, Kind.LONG: 9223371487098961920.0}


@dataclass(frozen=True)
class Operation:
    """What an operator is called in the form, and the bounds of its result."""

    name: str
    bounds: Callable[..., Bounds]
    result: np.dtype | None = None


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-np.clip(x, -100, 100)))


SIMPLE = {
    "Abs": Operation("abs", bounds.magnitude),
    "Add": Operation("add", bounds.corners(np.add)),
    "And": Operation("and", bounds.always(0, 1)),
    "Asin": Operation("asin", bounds.always(-1.6, 1.6)),
    "Atan": Operation("atan", bounds.rising(np.arctan)),
    "Cos": Operation("cos", bounds.always(-1, 1)),
    "Div": Operation("div", bounds.divided),
    "Equal": Operation("equal", bounds.always(0, 1), BOOL),
    "Exp": Operation("exp", bounds.rising(np.exp)),
    "Floor": Operation("floor", bounds.rising(np.floor)),
    "Greater": Operation("greater", bounds.always(0, 1), BOOL),
    "GreaterOrEqual": Operation("greater_equal", bounds.always(0, 1), BOOL),
    "Less": Operation("less", bounds.always(0, 1), BOOL),
    "LessOrEqual": Operation("less_equal", bounds.always(0, 1), BOOL),
    "Log": Operation("log", bounds.rising(np.log)),
    "Max": Operation("max", bounds.corners(np.maximum)),
    "Min": Operation("min", bounds.corners(np.minimum)),
    "Mul": Operation("mul", bounds.corners(np.multiply)),
    "Neg": Operation("neg", bounds.negated),
    "Not": Operation("not", bounds.always(0, 1)),
    "Or": Operation("or", bounds.always(0, 1)),
    "Reciprocal": Operation("reciprocal", lambda x: bounds.divided(bounds.of(np.ones(())), x)),
    "Relu": Operation("relu", bounds.rising(lambda x: np.maximum(x, 0))),
    "Sigmoid": Operation("sigmoid", bounds.rising(_sigmoid)),
    "Sign": Operation("sign", bounds.rising(np.sign)),
    "Sin": Operation("sin", bounds.always(-1, 1)),
    "Sqrt": Operation("sqrt", bounds.rising(lambda x: np.sqrt(np.maximum(x, 0)))),
    "Sub": Operation("sub", bounds.corners(np.subtract)),
    "Where": Operation("select", bounds.either),
}


def _simple(writer: Writer, node: Given) -> list[Value]:
    operation, (first, *others) = SIMPLE[node.op], node.operands(writer)
    if node.op in ("Max", "Min"):
        for other in others:  # Any number of operands, two at a time.
            first = writer.short(apply(writer, operation, [first, other]))
        return [first]
    return [apply(writer, operation, [first, *others])]


def apply(writer: Writer, operation: Operation, operands: Sequence[Value]) -> Value:
    """An operation on the elements of operands, broadcast as ONNX does."""
    shape = np.broadcast_shapes(*(v.shape for v in operands))
    spread = [value.broadcast(v, shape) for v in operands]
    limits = operation.bounds(*(v.bounds for v in spread))
    own = spread[-1].dtype  # That of numbers, which a condition may come before.
    dtype = operation.result or own
    if own.kind == "i":
        return _integers(writer, operation.name, dtype, spread, limits)
    kind = bounds.kind_of(dtype, limits)
    return _called(writer, operation.name, kind, dtype, spread, limits)


def _integers(
    writer: Writer, name: str, dtype: np.dtype, operands: Sequence[Value], limits: Bounds
) -> Value:
    """In 32 bits where bounds show that it may be; int32 wraps around as ONNX Runtime's does."""
    own = operands[-1].dtype
    if name == "div":
        name, limits = "int_div", Bounds(np.floor(limits.low), np.ceil(limits.high))
    if own == INT32 and dtype == own and not limits.within(INT_MOST):
        name = f"wrapped_{name}" if name in WRAPPING else name
        limits = bounds.between(limits.low.shape, -INT_MOST, INT_MOST - 1)
    elif not limits.within(LONG_MOST):
        limits = bounds.between(limits.low.shape, -LONG_MOST, LONG_MOST)
    kind = bounds.kind_of(dtype, limits)
    wide = Kind.LONG in (kind, *(v.kind for v in operands))
    if wide:
        operands = [to_kind(v, Kind.LONG) for v in operands]
    made = _called(
        writer, name, Kind.LONG if wide and dtype.kind == "i" else kind, dtype, operands, limits
    )
    return to_kind(made, kind)


def to_kind(given: Value, kind: Kind) -> Value:
    """Integers with more or fewer bits; conditions stay what they are."""
    if given.kind in (kind, Kind.BOOL):
        return given
    return given.map(lambda e: _converted(e, kind))


def _converted(expression: Expression, kind: Kind) -> Expression:
    if isinstance(expression, Number):
        return Number(kind, expression.value)
    return Call(f"to_{kind.value}", kind, (expression,))


def _called(
    writer: Writer,
    name: str,
    kind: Kind,
    dtype: np.dtype,
    operands: Sequence[Value],
    limits: Bounds,
) -> Value:
    operands = aligned(writer, operands)
    first = next((v for v in operands if not v.is_whole), operands[0])
    pieces = tuple(
        Call(name, kind, given) for given in zip(*(v.pieces for v in operands), strict=True)
    )
    return Value(dtype, first.shape, pieces, first.extents, first.axis, limits)


def aligned(writer: Writer, operands: Sequence[Value]) -> list[Value]:
    """Operands of one shape, cut into the same pieces."""
    cut = next((v for v in operands if not v.is_whole), None)
    if cut is None:
        return list(operands)
    axis, end = cut.axis, cut.shape[cut.axis]
    same = [v if v.is_whole or v.axis == axis else writer.written(v) for v in operands]
    starts = sorted({start for v in same if not v.is_whole for start in v.starts})
    extents = tuple(b - a for a, b in pairwise([*starts, end]))
    return [value.recut(v, axis, extents) for v in same]


# Operators with rules of their own

MOD, REST = Operation("mod", bounds.remainder), Operation("rest", bounds.rest)
DIFFERENT = Operation("not_equal", bounds.always(0, 1), BOOL)


def _identity(_: Writer, node: Given) -> list[Value]:
    return [node.value()]


def _clip(writer: Writer, node: Given) -> list[Value]:
    made = node.value()
    for index, name in ((1, "Max"), (2, "Min")):
        limit = node.constant(index)
        if limit is not None:
            made = apply(writer, SIMPLE[name], [made, writer.constant(limit)])
    return [made]


def _mod(writer: Writer, node: Given) -> list[Value]:
    return [apply(writer, REST if node.attributes.get("fmod", 0) else MOD, node.operands(writer))]


def _cast(writer: Writer, node: Given) -> list[Value]:
    given, dtype = node.value(), TYPES[node.attributes["to"]]
    if dtype == given.dtype:
        return [given]
    if dtype == BOOL:
        zero = writer.constant(np.zeros((), given.dtype))
        return [apply(writer, DIFFERENT, [given, zero])]
    if dtype == FLOAT:
        name = "from_bool" if given.kind is Kind.BOOL else "to_float"
        return [_changed(given, name, Kind.FLOAT, dtype, given.bounds)]
    if given.kind is Kind.BOOL:
        return [_changed(given, "bool_to_int", Kind.INT, dtype, given.bounds)]
    return [_to_integers(given, dtype)]


def _to_integers(given: Value, dtype: np.dtype) -> Value:
    most = INT_MOST if dtype == INT32 else LONG_MOST
    if given.dtype != FLOAT:
        fits = given.bounds.within(most)
        limits = given.bounds if fits else bounds.between(given.shape, -most, most - 1)
        kind = bounds.kind_of(dtype, limits)
        made = Value(dtype, given.shape, given.pieces, given.extents, given.axis, limits)
        return to_kind(made, kind)
    limits = Bounds(*(np.clip(np.trunc(b), -most, most) for b in _ends(given.bounds)))
    kind = Kind.INT if dtype == INT32 else bounds.kind_of(dtype, limits)
    largest = LARGEST_FLOATS[kind]
    low, high = (float(np.clip(b, -largest, largest)) for b in
                 (limits.low.min(), limits.high.max()))  # fmt: skip
    ends = Number(Kind.FLOAT, low), Number(Kind.FLOAT, high)
    made = given.map(lambda e: Call("truncated", kind, (e, *ends)))
    limits = Bounds(np.clip(limits.low, low, high), np.clip(limits.high, low, high))
    return Value(dtype, made.shape, made.pieces, made.extents, made.axis, limits)


def _ends(given: Bounds) -> tuple[np.ndarray, np.ndarray]:
    return given.low, given.high


def _changed(given: Value, name: str, kind: Kind, dtype: np.dtype, limits: Bounds) -> Value:
    made = given.map(lambda e: Call(name, kind, (e,)))
    return Value(dtype, made.shape, made.pieces, made.extents, made.axis, limits)


RULES: dict[str, Rule] = {
    **dict.fromkeys(SIMPLE, _simple),
    "Cast": _cast,
    "Clip": _clip,
    "Identity": _identity,
    "Mod": _mod,
}
