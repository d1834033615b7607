"""A tensor of one sample that is not written down yet: expressions of its elements, in pieces."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate

import numpy as np

from purelight_shader.form import places
from purelight_shader.form.elements import Expression, Kind, is_cheap, size
from purelight_shader.form.places import Move
from purelight_shader.lowering import bounds
from purelight_shader.lowering.bounds import Bounds

Shape = tuple[int, ...]


@dataclass(frozen=True)
class Value:
    """A tensor.

    Arguments:
        dtype: as ONNX has it.
        shape: of one sample.
        pieces: expressions, one after the other along `axis`; the counters of each begin at 0.
        extents: of the pieces along `axis`.
        axis: 0 where there is one piece only.
        bounds: of every element.
    """

    dtype: np.dtype
    shape: Shape
    pieces: tuple[Expression, ...]
    extents: tuple[int, ...]
    axis: int
    bounds: Bounds

    @staticmethod
    def whole(dtype: np.dtype, shape: Shape, expression: Expression, bounds: Bounds) -> Value:
        """A value in one piece."""
        return Value(dtype, shape, (expression,), (shape[0] if shape else 1,), 0, bounds)

    @property
    def kind(self) -> Kind:
        return self.pieces[0].kind

    @property
    def expression(self) -> Expression:
        """The expression of a value in one piece."""
        (piece,) = self.pieces
        return piece

    @property
    def is_whole(self) -> bool:
        return len(self.pieces) == 1

    @property
    def is_cheap(self) -> bool:
        """Whether it may be read any number of times without being written down."""
        return self.is_whole and is_cheap(self.expression)

    @property
    def written(self) -> int:
        """How much text its expressions are."""
        return sum(map(size, self.pieces))

    @property
    def starts(self) -> tuple[int, ...]:
        """Where the pieces begin along the axis."""
        return tuple(accumulate(self.extents, initial=0))[:-1]

    def piece_shape(self, index: int) -> Shape:
        """Extents of the counters of a piece."""
        if not self.shape:
            return ()
        return (*self.shape[: self.axis], self.extents[index], *self.shape[self.axis + 1 :])

    def map(self, function: Callable[[Expression], Expression]) -> Value:
        """Another expression of every piece, for the same elements."""
        return replace(self, pieces=tuple(map(function, self.pieces)))


def sliced(value: Value, axis: int, start: int, count: int, step: int = 1) -> Value:
    """Elements start, start + step, ... of an axis, `count` of them."""
    window = (slice(None),) * axis + (slice(start, start + (count - 1) * step + 1, step),)
    limits = value.bounds.map(lambda a: a[window])
    shape = (*value.shape[:axis], count, *value.shape[axis + 1 :])
    if value.is_whole or axis != value.axis:
        pieces = tuple(places.moved(e, places.sliced(axis, start, step)) for e in value.pieces)
        extents = (shape[0],) if value.is_whole else value.extents
        return Value(value.dtype, shape, pieces, extents, value.axis, limits)
    pieces, extents = (), ()
    for expression, begin, extent in zip(value.pieces, value.starts, value.extents, strict=True):
        first = max(0, -(-(begin - start) // step))  # Of the elements taken, the first inside.
        inside = min(count, -(-(begin + extent - start) // step)) - first
        if inside > 0:
            move = places.sliced(axis, start + first * step - begin, step)
            pieces += (places.moved(expression, move),)
            extents += (inside,)
    axis = axis if len(pieces) > 1 else 0
    extents = extents if len(pieces) > 1 else (shape[0],)
    return Value(value.dtype, shape, pieces, extents, axis, limits)


def permuted(value: Value, order: Sequence[int]) -> Value:
    """Axis k is what axis `order[k]` was."""
    axis = list(order).index(value.axis) if not value.is_whole else 0
    shape = tuple(value.shape[k] for k in order)
    return _rearranged(
        value, shape, axis, places.permuted(order), lambda a: np.transpose(a, list(order))
    )


def squeezed(value: Value, axes: Sequence[int]) -> Value:
    """Without some axes of one element."""
    shape = tuple(size for k, size in enumerate(value.shape) if k not in axes)
    axis = 0 if value.is_whole else value.axis - sum(k < value.axis for k in axes)
    return _rearranged(value, shape, axis, places.without(axes), lambda a: a.reshape(shape))


def unsqueezed(value: Value, axes: Sequence[int]) -> Value:
    """With axes of one element at these positions of the result."""
    rank = len(value.shape) + len(axes)
    own = [k for k in range(rank) if k not in axes]
    shape = tuple(1 if k in axes else value.shape[own.index(k)] for k in range(rank))
    axis = 0 if value.is_whole else own[value.axis]
    move = places.inserted(axes, rank)
    return _rearranged(value, shape, axis, move, lambda a: a.reshape(shape))


def broadcast(value: Value, shape: Shape) -> Value:
    """Repeated along leading axes and along those of one element."""
    missing = len(shape) - len(value.shape)
    value = unsqueezed(value, range(missing)) if missing else value
    repeated = [k for k, size in enumerate(shape) if value.shape[k] != size]
    if not repeated:
        return value
    limits = value.bounds.map(lambda a: np.broadcast_to(a, shape))
    pieces = tuple(places.moved(e, places.held(repeated)) for e in value.pieces)
    extents = (shape[0],) if value.is_whole else value.extents
    return Value(value.dtype, shape, pieces, extents, value.axis, limits)


def reshaped(value: Value, shape: Shape) -> Value | None:
    """The same elements in the same order; None if its expressions do not allow it."""
    if not value.is_whole:
        return None
    expression = places.reshaped(value.expression, value.shape, shape)
    if expression is None:
        return None
    limits = value.bounds.map(lambda a: a.reshape(shape))
    return Value.whole(value.dtype, shape, expression, limits)


def joined(values: Sequence[Value], axis: int) -> Value:
    """Values side by side, all of one kind and each whole or in pieces along the same axis."""
    first = values[0]
    width = sum(value.shape[axis] for value in values)
    shape = (*first.shape[:axis], width, *first.shape[axis + 1 :])
    limits = bounds.joined([value.bounds for value in values], axis)
    pieces = tuple(e for value in values for e in value.pieces)
    extents = tuple(
        e for v in values for e in ((v.shape[axis],) if v.is_whole else v.extents)
    )  # fmt: skip
    if len(pieces) == 1:
        return Value.whole(first.dtype, shape, pieces[0], limits)
    return Value(first.dtype, shape, pieces, extents, axis, limits)


def recut(value: Value, axis: int, extents: tuple[int, ...]) -> Value:
    """The same value in pieces of other extents, each of which lies in one of its own."""
    starts = accumulate(extents, initial=0)
    parts = [sliced(value, axis, start, n) for start, n in zip(starts, extents, strict=False)]
    pieces = tuple(part.expression for part in parts)
    return Value(value.dtype, value.shape, pieces, extents, axis, value.bounds)


def _rearranged(
    value: Value,
    shape: Shape,
    axis: int,
    move: Move,
    transform: Callable[[np.ndarray], np.ndarray],
) -> Value:
    pieces = tuple(places.moved(e, move) for e in value.pieces)
    extents = (shape[0] if shape else 1,) if value.is_whole else value.extents
    return Value(value.dtype, shape, pieces, extents, axis, value.bounds.map(transform))
