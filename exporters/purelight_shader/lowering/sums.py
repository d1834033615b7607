"""Operators that go along an axis."""

from __future__ import annotations

from collections.abc import Sequence
from math import prod

import numpy as np

from purelight_shader.form.elements import Kind, Load, Place
from purelight_shader.form.statements import Fold, Scan
from purelight_shader.lowering import bounds, value
from purelight_shader.lowering.bounds import INT_MOST, LONG_MOST, Bounds
from purelight_shader.lowering.elementwise import Operation, apply, to_kind
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer, contiguous, load_all

EXP_OF_DIFFERENCE = Operation("exp", bounds.rising(np.exp))
DIFFERENCE = Operation("sub", bounds.corners(np.subtract))
SHARE = Operation("div", bounds.always(0, 1))


def folded(writer: Writer, given: Value, axes: Sequence[int], operation: str) -> Value:
    """A value with some axes folded to one element each."""
    given = writer.whole(given)
    limits = _limits(given, tuple(axes), operation)
    if given.kind is not Kind.FLOAT:
        given, limits = _room(given, limits)
    outer = [k for k in range(len(given.shape)) if k not in axes]
    long = [[k for k in group if given.shape[k] > 1] for group in (outer, axes)]
    ordered = value.permuted(given, [*long[0], *long[1], *_single(given.shape)])
    ordered = value.squeezed(ordered, range(len(long[0]) + len(long[1]), len(given.shape)))
    extents, inner = ordered.shape[: len(long[0])], ordered.shape[len(long[0]) :]
    target = writer.array(given.kind, prod(extents))
    writer.add(Fold(operation, extents, inner, load_all(target, extents), ordered.expression))
    kept = tuple(1 if k in axes else size for k, size in enumerate(given.shape))
    return Value.whole(given.dtype, kept, load_all(target, kept), limits)


def _single(shape: tuple[int, ...]) -> list[int]:
    """Axes of one element."""
    return [k for k, size in enumerate(shape) if size == 1]


def _limits(given: Value, axes: tuple[int, ...], operation: str) -> Bounds:
    reduce = np.sum if operation == "add" else np.max
    low, high = (reduce(b, axis=axes, keepdims=True) for b in
                 (given.bounds.low, given.bounds.high))  # fmt: skip
    return Bounds(np.maximum(low, -bounds.MOST), np.minimum(high, bounds.MOST))


def _room(given: Value, limits: Bounds) -> tuple[Value, Bounds]:
    """Integers in as many bits as their sums take."""
    most = INT_MOST if given.dtype == np.int32 else LONG_MOST
    if not limits.within(most):
        limits = bounds.between(limits.low.shape, -most, most - 1)
    wide = bounds.kind_of(given.dtype, limits) is Kind.LONG or given.kind is Kind.LONG
    return to_kind(given, Kind.LONG if wide else Kind.INT), limits


def _reduce(writer: Writer, node: Given) -> list[Value]:
    axes = [node.axis(axis) for axis in node.numbers(1)]
    made = folded(writer, node.value(), axes, "add" if node.op == "ReduceSum" else "max")
    return [made if node.attributes.get("keepdims", 1) else value.squeezed(made, axes)]


def _softmax(writer: Writer, node: Given) -> list[Value]:
    axis, given = node.axis(node.attributes.get("axis", -1)), node.value()
    given = given if given.is_cheap else writer.written(given)
    largest = folded(writer, given, [axis], "max")
    below = apply(writer, DIFFERENCE, [given, largest])
    powers = writer.written(apply(writer, EXP_OF_DIFFERENCE, [below]))
    total = folded(writer, powers, [axis], "add")
    return [apply(writer, SHARE, [powers, total])]


def _cumulative(writer: Writer, node: Given) -> list[Value]:
    constant = node.constant(1)
    assert constant is not None
    axis, given = node.axis(constant.item()), writer.whole(node.value())
    exclusive, reverse = (bool(node.attributes.get(k, 0)) for k in ("exclusive", "reverse"))
    if given.shape[axis] == 1:
        zeros = writer.constant(np.zeros(given.shape, given.dtype))
        return [zeros if exclusive else given]
    limits = _cumulative_limits(given, axis)
    if given.kind is not Kind.FLOAT:
        given, limits = _room(given, limits)
    others = [k for k, size in enumerate(given.shape) if k != axis and size > 1]
    order = [*others, axis]
    ordered = value.permuted(given, [*order, *_single(given.shape)])
    ordered = value.squeezed(ordered, range(len(order), len(given.shape)))
    target = writer.array(given.kind, prod(given.shape))
    strides = contiguous(given.shape)
    place = Place(0, tuple(strides[k] for k in order))
    writer.add(Scan(ordered.shape, Load(target, place), ordered.expression, exclusive, reverse))
    return [Value.whole(given.dtype, given.shape, load_all(target, given.shape), limits)]


def _cumulative_limits(given: Value, axis: int) -> Bounds:
    """Any number of the elements may have been added."""
    low = np.minimum(given.bounds.low, 0).sum(axis, keepdims=True)
    high = np.maximum(given.bounds.high, 0).sum(axis, keepdims=True)
    shape = given.shape
    return Bounds(
        np.broadcast_to(np.maximum(low, -bounds.MOST), shape),
        np.broadcast_to(np.minimum(high, bounds.MOST), shape),
    )


RULES: dict[str, Rule] = {
    "CumSum": _cumulative,
    "ReduceMax": _reduce,
    "ReduceSum": _reduce,
    "Softmax": _softmax,
}
