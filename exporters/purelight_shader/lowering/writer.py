"""Writes values down as statements, once it is better than to repeat their expressions."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np

from purelight_shader.form import places
from purelight_shader.form.elements import (
    Array,
    Call,
    Expression,
    Kind,
    Load,
    Number,
    Place,
    loads,
)
from purelight_shader.form.statements import Loop, Shape, Statement
from purelight_shader.form.store import Store
from purelight_shader.lowering import bounds, value
from purelight_shader.lowering.rolling import rolled, runs
from purelight_shader.lowering.value import Value

LONGEST = 64  # Of an expression, in operations, loads and numbers.


class Writer:
    """Collects the statements of one network.

    Arguments:
        store: takes its constants.
        reads: how many elements of each value of the graph are read, by name.
    """

    def __init__(self, store: Store, reads: Mapping[str, float]) -> None:
        self.store, self.reads = store, reads
        self.statements: list[Statement] = []
        self._count = 0

    def array(self, kind: Kind, size: int) -> Array:
        """Memory that nothing uses yet."""
        self._count += 1
        return Array(f"t{self._count}", kind, size)

    def add(self, statement: Statement) -> None:
        """Adds a statement; what it reads was written before."""
        self.statements.append(statement)

    def settled(self, name: str, made: Value) -> Value:
        """A value of the graph, written down if it is long or read more than once."""
        often = self.reads[name] > prod(made.shape)
        long = made.written > LONGEST
        return self.written(made) if long or (often and not made.is_cheap) else made

    def short(self, made: Value) -> Value:
        """A value, written down if it is long."""
        return self.written(made) if made.written > LONGEST else made

    def whole(self, made: Value) -> Value:
        """A value in one piece."""
        return made if made.is_whole else self.written(made)

    def loaded(self, made: Value) -> Value:
        """A value whose elements lie in an array or constant, where they can be counted off."""
        first = made.pieces[0]
        lies = made.is_whole and isinstance(first, Load) and not first.place.computed
        return made if lies else self.written(made)

    def reshaped(self, made: Value, shape: Shape) -> Value:
        """The same elements in another shape."""
        there = value.reshaped(made, shape) or value.reshaped(self.written(made), shape)
        assert there is not None  # What is written lies in order.
        return there

    def written(self, made: Value) -> Value:
        """A value that lies in an array of its own."""
        target = self.array(made.kind, prod(made.shape))
        self.write(target, made)
        return Value.whole(made.dtype, made.shape, load_all(target, made.shape), made.bounds)

    def write(self, target: Array, made: Value) -> None:
        """Puts every element into an array, in order."""
        strides = contiguous(made.shape)
        step = strides[made.axis] if made.shape else 0
        for first, steps, count in runs(made.pieces, made.extents):
            place = Place(made.starts[first] * step, strides)
            expression, extents = made.pieces[first], made.piece_shape(first)
            if count > 1:
                place = Place(place.offset, (made.extents[first] * step, *strides))
                expression, extents = rolled(expression, steps), (count, *extents)
            self.loop(extents, Load(target, place), expression)

    def loop(self, extents: Shape, target: Load, expression: Expression) -> None:
        """Adds a loop with as few counters as do."""
        self.add(Loop(*_merged(extents, target, expression)))

    # Constants

    def constant(self, data: np.ndarray, shape: Shape | None = None) -> Value:
        """The value of an initializer: a number if all of its elements are equal."""
        shape = data.shape if shape is None else shape
        limits = bounds.of(data.reshape(shape))
        kind = bounds.kind_of(data.dtype, limits)
        if (data == data.flat[0]).all():
            number: Expression = Number(kind, data.flat[0].item())
            return Value.whole(data.dtype, shape, number, limits)
        stored = self.store.add(data, Kind.INT if kind is Kind.BOOL else kind)
        made = Value.whole(data.dtype, shape, Load(stored, Place(0, contiguous(shape))), limits)
        return self.truth(made) if kind is Kind.BOOL else made

    def truth(self, made: Value) -> Value:
        """Truth values that are stored as integers."""
        return made.map(lambda e: Call("not_equal", Kind.BOOL, (e, Number(Kind.INT, 0))))


def load_all(source: Array, shape: Shape) -> Load:
    """Every element of an array that lies in order."""
    return Load(source, Place(0, contiguous(shape)))


def contiguous(shape: Shape) -> Shape:
    """Strides of elements that lie in order; zero along axes of one element."""
    strides, step = [], 1
    for size in reversed(shape):
        strides.append(step if size > 1 else 0)
        step *= size
    return tuple(reversed(strides))


def _merged(extents: Shape, target: Load, expression: Expression) -> tuple[Shape, Load, Expression]:
    given = list({load.place.strides: None for load in (target, *loads(expression))})
    fewer, strides = places.merged(extents, given)
    new = dict(zip(given, strides, strict=True))

    def move(offset: int, old: Shape) -> tuple[int, Shape]:
        return offset, new[old]

    moved = places.moved(target, move)
    assert isinstance(moved, Load)
    return fewer, moved, places.moved(expression, move)
