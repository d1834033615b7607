"""Changes of the counters that expressions run over: what slicing, reshaping and the like are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

from purelight_shader.form.elements import Call, Expression, Load, Number, Place, loads

Shape = tuple[int, ...]
Move = Callable[[int, Shape], tuple[int, Shape]]  # Offset and strides to those of other counters.


def moved(expression: Expression, move: Move) -> Expression:
    """An expression of other counters."""
    if isinstance(expression, Number):
        return expression
    if isinstance(expression, Call):
        operands = tuple(moved(operand, move) for operand in expression.operands)
        return Call(expression.operation, expression.kind, operands)
    place = expression.place
    computed = tuple((moved(inner, move), stride) for inner, stride in place.computed)
    return Load(expression.source, Place(*move(place.offset, place.strides), computed))


def sliced(axis: int, start: int, step: int = 1) -> Move:
    """Counter k of an axis becomes `start + step k`."""

    def move(offset: int, strides: Shape) -> tuple[int, Shape]:
        stride = strides[axis]
        return offset + start * stride, (*strides[:axis], step * stride, *strides[axis + 1 :])

    return move


def permuted(order: Sequence[int]) -> Move:
    """Axis k is what axis `order[k]` was."""
    return lambda offset, strides: (offset, tuple(strides[k] for k in order))


def without(axes: Sequence[int]) -> Move:
    """Axes of one element are left out."""
    return lambda offset, strides: (
        offset, tuple(s for k, s in enumerate(strides) if k not in axes)
    )  # fmt: skip


def inserted(axes: Sequence[int], rank: int) -> Move:
    """Axes along which nothing changes come in; `rank` counts all of them."""

    def move(offset: int, strides: Shape) -> tuple[int, Shape]:
        others = iter(strides)
        return offset, tuple(0 if k in axes else next(others) for k in range(rank))

    return move


def held(axes: Sequence[int]) -> Move:
    """Nothing changes along some axes any more."""
    return lambda offset, strides: (
        offset, tuple(0 if k in axes else s for k, s in enumerate(strides))
    )  # fmt: skip


def reshaped(expression: Expression, old: Shape, new: Shape) -> Expression | None:
    """An expression over the same elements in the same order; None if its loads do not allow it."""
    strides = {load.place.strides for load in loads(expression)}
    found = {given: _new_strides(given, old, new) for given in strides}
    if None in found.values():
        return None
    known = {given: made for given, made in found.items() if made is not None}
    return moved(expression, lambda offset, given: (offset, known[given]))


def _new_strides(strides: Shape, old: Shape, new: Shape) -> Shape | None:
    """Strides of the same elements with other sizes, axes of one element left to be zero."""
    groups = merged(old, [strides])
    sizes, (joined,) = groups
    result: list[int] = []
    remaining = [(size, stride) for size, stride in zip(sizes, joined, strict=True)]
    room, stride = remaining.pop() if remaining else (1, 0)
    for size in reversed(new):
        if size == 1:
            result.append(0)
            continue
        if room == 1 and remaining:
            room, stride = remaining.pop()
        if room % size:
            return None
        result.append(stride)
        room, stride = room // size, stride * size
    return tuple(reversed(result))


def merged(extents: Shape, strides: Sequence[Shape]) -> tuple[Shape, list[Shape]]:
    """Fewer loops over the same elements: neighbours join where all strides go on evenly.

    Returns:
        Extents, none of them one; and strides for each of those given.
    """
    kept = [k for k, extent in enumerate(extents) if extent > 1]
    groups: list[list[int]] = [[kept[0]]] if kept else []
    for outer, inner in pairwise(kept):
        if all(s[outer] == s[inner] * extents[inner] for s in strides):
            groups[-1].append(inner)
        else:
            groups.append([inner])
    sizes = []
    for group in groups:
        size = 1
        for k in group:
            size *= extents[k]
        sizes.append(size)
    return tuple(sizes), [tuple(s[group[-1]] for group in groups) for s in strides]
