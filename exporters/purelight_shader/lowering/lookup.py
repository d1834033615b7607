"""Operators that look up elements."""

from __future__ import annotations

from math import prod

import numpy as np

from purelight_shader.form.elements import Kind, Load, Place
from purelight_shader.form.statements import Rows
from purelight_shader.form.store import FOUR
from purelight_shader.lowering import bounds, value
from purelight_shader.lowering.arrangement import columns, lookup, safe
from purelight_shader.lowering.bounds import Bounds
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer, contiguous, load_all


def _gather(writer: Writer, node: Given) -> list[Value]:
    table, chosen = node.constants
    if chosen is not None:
        axis = node.axis(node.attributes.get("axis", 0))
        return [columns(writer, node.value(), axis, chosen)]
    assert table is not None
    index = node.values[1]
    assert index is not None
    return [_rows(writer, table, index)]


def _rows(writer: Writer, table: np.ndarray, index: Value) -> Value:
    """Rows of a table; those whose size is a multiple of four are read in fours."""
    shape = (*index.shape, *table.shape[1:])
    width = prod(table.shape[1:])
    limits = _limits(table, len(index.shape), shape)
    place = safe(writer, writer.whole(index), len(table))
    if (table == table.flat[0]).all():
        flat = writer.constant(table)
        return Value.whole(table.dtype, shape, flat.expression, limits)
    if table.dtype.kind == "f" and width % FOUR == 0:
        return _fours(writer, table, place, shape, limits)
    return _single(writer, table, place if width == 1 else writer.written(place), shape, limits)


def _limits(table: np.ndarray, rank: int, shape: tuple[int, ...]) -> Bounds:
    """Of each column, the least and largest in the whole table."""
    ends = (f(table, 0).astype(np.float64) for f in (np.min, np.max))
    lead = (1,) * rank
    return Bounds(*(np.broadcast_to(e.reshape(lead + table.shape[1:]), shape) for e in ends))


def _fours(
    writer: Writer, table: np.ndarray, place: Value, shape: tuple[int, ...], limits: Bounds
) -> Value:
    stored = writer.store.add(table, Kind.FLOAT, buffered=True)
    target = writer.array(Kind.FLOAT, prod(shape))
    fours = prod(table.shape[1:]) // FOUR
    writer.add(Rows(place.shape, target, stored, fours, place.expression))
    return Value.whole(table.dtype, shape, load_all(target, shape), limits)


def _single(
    writer: Writer, table: np.ndarray, place: Value, shape: tuple[int, ...], limits: Bounds
) -> Value:
    """Element by element."""
    kind = bounds.kind_of(table.dtype, bounds.of(table))
    stored = writer.store.add(table, Kind.INT if kind is Kind.BOOL else kind)
    rank, inner = len(place.shape), contiguous(table.shape[1:])
    row = value.unsqueezed(place, range(rank, len(shape))).expression
    strides = (0,) * rank + inner
    load = Load(stored, Place(0, strides, ((row, prod(table.shape[1:])),)))
    made = Value.whole(table.dtype, shape, load, limits)
    return writer.truth(made) if kind is Kind.BOOL else made


def _gather_elements(writer: Writer, node: Given) -> list[Value]:
    axis = node.axis(node.attributes.get("axis", 0))
    return [lookup(writer, node.value(0), axis, node.value(1))]


RULES: dict[str, Rule] = {"Gather": _gather, "GatherElements": _gather_elements}
