"""Operators that only move elements: nothing is computed, places change."""

from __future__ import annotations

import numpy as np

from purelight_shader.form.elements import Call, Kind, Load, Place
from purelight_shader.lowering import value
from purelight_shader.lowering.elementwise import to_kind
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer


def _concat(writer: Writer, node: Given) -> list[Value]:
    axis = node.axis(node.attributes.get("axis", 0))
    parts = [v for v in node.values if v is not None]
    if Kind.LONG in {v.kind for v in parts}:
        parts = [to_kind(v, Kind.LONG) for v in parts]
    parts = [v if v.is_whole or v.axis == axis else writer.written(v) for v in parts]
    return [value.joined(parts, axis)]


def _split(_: Writer, node: Given) -> list[Value]:
    axis, start, parts = node.axis(node.attributes.get("axis", 0)), 0, []
    for size in node.numbers(1):
        parts.append(value.sliced(node.value(), axis, start, size))
        start += size
    return parts


def _slice(_: Writer, node: Given) -> list[Value]:
    made = node.value()
    starts, ends, axes = (node.numbers(k) for k in (1, 2, 3))
    steps = node.numbers(4) if node.constant(4) is not None else [1] * len(axes)
    for start, end, axis, step in zip(starts, ends, map(node.axis, axes), steps, strict=True):
        taken = range(made.shape[axis])[slice(start, end, step)]
        made = value.sliced(made, axis, taken.start, len(taken), step)
    return [made]


def _reshape(writer: Writer, node: Given) -> list[Value]:
    return [writer.reshaped(node.value(), node.outputs[0].shape)]


def _transpose(_: Writer, node: Given) -> list[Value]:
    order = [axis - 1 for axis in node.attributes["perm"][1:]]
    return [value.permuted(node.value(), order)]


def _squeeze(_: Writer, node: Given) -> list[Value]:
    return [value.squeezed(node.value(), [node.axis(a) for a in node.numbers(1)])]


def _unsqueeze(_: Writer, node: Given) -> list[Value]:
    axes = node.numbers(1)
    rank = len(node.value().shape) + 1 + len(axes)
    return [value.unsqueezed(node.value(), [axis % rank - 1 for axis in axes])]


def columns(writer: Writer, given: Value, axis: int, chosen: np.ndarray) -> Value:
    """Fixed elements of an axis, which the axes of `chosen` take the place of."""
    size = given.shape[axis]
    flat = np.where(chosen < 0, chosen + size, chosen).ravel().astype(np.int64)
    steps = np.unique(np.diff(flat))
    if len(flat) == 1 or (len(steps) == 1 and steps[0] > 0):
        step = int(steps[0]) if len(flat) > 1 else 1
        made = value.sliced(given, axis, int(flat[0]), len(flat), step)
    else:
        made = _picked(writer, writer.loaded(given), axis, flat)
    shape = (*given.shape[:axis], *chosen.shape, *given.shape[axis + 1 :])
    return made if shape == made.shape else writer.reshaped(made, shape)


def _picked(writer: Writer, given: Value, axis: int, chosen: np.ndarray) -> Value:
    """By a list of places, which is a constant itself."""
    load = given.expression
    assert isinstance(load, Load)
    shape = (*given.shape[:axis], len(chosen), *given.shape[axis + 1 :])
    limits = given.bounds.map(lambda a: np.take(a, chosen, axis))
    listed = writer.constant(chosen.astype(np.int32))
    rank, stride = len(shape), load.place.strides[axis]
    listed = value.unsqueezed(listed, [k for k in range(rank) if k != axis])
    strides = tuple(0 if k == axis else s for k, s in enumerate(load.place.strides))
    place = Place(load.place.offset, strides, ((listed.expression, stride),))
    return Value.whole(given.dtype, shape, Load(load.source, place), limits)


def lookup(writer: Writer, given: Value, axis: int, index: Value) -> Value:
    """Elements of an axis by computed places (GatherElements)."""
    given, index = writer.loaded(given), writer.whole(index)
    load = given.expression
    assert isinstance(load, Load)
    stride, size = load.place.strides[axis], given.shape[axis]
    strides = tuple(0 if k == axis else s for k, s in enumerate(load.place.strides))
    place = Place(load.place.offset, strides, ((safe(writer, index, size).expression, stride),))
    low, high = (f(b, axis, keepdims=True) for f, b in
                 ((np.min, given.bounds.low), (np.max, given.bounds.high)))  # fmt: skip
    limits = type(given.bounds)(*(np.broadcast_to(b, index.shape) for b in (low, high)))
    return Value.whole(given.dtype, index.shape, Load(load.source, place), limits)


def safe(writer: Writer, index: Value, size: int) -> Value:
    """Places below `size` and not below 0, whatever comes in; negative ones count from behind."""
    name = "place_from_end" if (index.bounds.low < 0).any() else "place"
    last = writer.constant(np.asarray(size - 1, np.int32)).expression
    narrow = to_kind(index, Kind.INT)
    return narrow.map(lambda e: Call(name, Kind.INT, (e, last)))


RULES: dict[str, Rule] = {
    "Concat": _concat,
    "Reshape": _reshape,
    "Slice": _slice,
    "Split": _split,
    "Squeeze": _squeeze,
    "Transpose": _transpose,
    "Unsqueeze": _unsqueeze,
}
