"""Glass that is open, inside out, or in other glass; and emitters cast into it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from purelight_import.sanity.lines import Crossings, crossings
from purelight_import.sanity.subject import Subject

OPEN, INSIDE_OUT, OVERLAP, CAST_IN = 0.03, 0.5, 0.01, 0.9  # shares of the lines that tell it
LEAST = 24  # lines, to judge by
TOUCHING = 2e-3  # of the extent: bodies that share less than that only touch


@dataclass
class _Counts:
    """Lines by shape, and by pairs of shapes."""

    met: np.ndarray
    unbalanced: np.ndarray
    negative: np.ndarray
    cast_in: np.ndarray
    hollows: np.ndarray
    overlaps: dict[tuple[int, int], int] = field(default_factory=dict)

    @staticmethod
    def none(shapes: int) -> _Counts:
        met, unbalanced, negative, cast_in, hollows = np.zeros((5, shapes), np.int64)
        return _Counts(met, unbalanced, negative, cast_in, hollows)


def glass_doubts(subject: Subject) -> Iterator[str]:
    """One line for each doubt about a glass body."""
    if not subject.refracting.any():
        return
    found = crossings(subject)
    counts = _Counts.none(len(subject.shapes))
    starts = np.flatnonzero(np.diff(found.line, prepend=-1)).tolist()
    for begin, end in zip(starts, [*starts[1:], len(found.line)], strict=True):
        _walk(subject, found, begin, end, counts)
    yield from _sentences(subject, counts)


def _walk(subject: Subject, found: Crossings, begin: int, end: int, counts: _Counts) -> None:
    """Follows one line through the glass."""
    depth = 0
    balance: dict[int, int] = {}
    inside: list[tuple[int, float]] = []  # bodies entered and not yet left, and where
    hollows: set[int] = set()  # surfaces of cavities that the line is in
    negative: set[int] = set()
    seen: set[int] = set()
    cast_in: list[int] = []
    for k in range(begin, end):
        shape, enters = int(found.shape[k]), bool(found.enters[k])
        seen.add(shape)
        if not subject.refracting[shape]:
            cast_in += [shape] if depth > 0 else []
            counts.hollows[shape] += 1
            continue
        depth += 1 if enters else -1
        balance[shape] = balance.get(shape, 0) + (1 if enters else -1)
        if depth < 0:
            negative.add(shape)
            depth = 0
        if enters and shape in hollows:
            hollows.discard(shape)
        elif enters:
            inside.append((shape, found.distance[k]))
        elif not _leave(subject, inside, shape, found.distance[k], counts):
            hollows.add(shape)
    for shape in seen:
        counts.met[shape] += 1
    if not negative:
        np.add.at(counts.cast_in, cast_in, 1)
    for shape in negative:
        counts.negative[shape] += 1
    if sum(balance.values()):
        for shape in (s for s, b in balance.items() if b):
            counts.unbalanced[shape] += 1


def _leave(
    subject: Subject, inside: list[tuple[int, float]], shape: int, at: float, counts: _Counts
) -> bool:
    """Leaves a body; what was entered after it, and not left, overlaps it.

    Returns:
        Whether it had been entered; if not, the surface may be that of a cavity in another body.
    """
    place = next((i for i in reversed(range(len(inside))) if inside[i][0] == shape), None)
    if place is None:
        return False
    for other, entered in inside[place + 1 :]:
        if other != shape and at - entered > TOUCHING * subject.extent:
            pair = min(shape, other), max(shape, other)
            counts.overlaps[pair] = counts.overlaps.get(pair, 0) + 1
    inside.pop(place)
    return True


def _sentences(subject: Subject, counts: _Counts) -> Iterator[str]:
    for shape in np.flatnonzero(subject.refracting & (counts.met >= LEAST)):
        name, met = subject.name(int(shape)), counts.met[shape]
        inverted = counts.negative[shape] > INSIDE_OUT * met
        if inverted:
            yield (f"glass '{name}' is inside out as seen from outside; turn its faces "
                   "(flip_normals), or its light is refracted wrongly")  # fmt: skip
        elif counts.unbalanced[shape] > OPEN * met and subject.closed(int(shape)):
            yield (f"glass '{name}' touches other glass: where two surfaces are at one place, "
                   "light meets either by chance; move them a little apart")  # fmt: skip
        elif counts.unbalanced[shape] > OPEN * met:
            yield (f"glass '{name}' is open: light that enters it never leaves as it should; close "
                   "the mesh, give it a wall, or make it thin (thindielectric, --glass "
                   f"'{name}=thin')")  # fmt: skip
    for (first, second), lines in counts.overlaps.items():
        if lines > max(LEAST, OVERLAP * min(counts.met[first], counts.met[second])):
            yield (f"glass '{subject.name(first)}' and '{subject.name(second)}' overlap; move "
                   "them apart or join them: light leaves what it entered last")  # fmt: skip
    for shape in np.flatnonzero(subject.emitting & ~subject.refracting):
        lines = counts.hollows[shape]
        if lines >= LEAST and counts.cast_in[shape] > CAST_IN * lines:
            yield (f"emitter '{subject.name(int(shape))}' stands in solid glass; unless it is "
                   "cast in, give the glass an inner wall, or make it thin "
                   "(thindielectric)")  # fmt: skip
