"""A polygon cut into triangles by its ears: corners whose neighbours see each other within it.

After G. H. Meisters, "Polygons have ears", American Mathematical Monthly 82 (1975).
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Iterator
from itertools import product
from math import floor

import numpy as np

ROUNDING = 1e-15  # Of the square of a polygon's size
LEAST = (ROUNDING, -1e-12, -1e-8, -1e-6, -1e-4, -1e-3)  # Less where polygons touch themselves.
MOST_CORNERS = 50_000  # The time may grow with their square.


def ears(position: np.ndarray) -> np.ndarray | None:
    """Corners [N - 2, 3] of triangles that fill a polygon [N, 3], wound as it is.

    None where there are none: it crosses itself, has no area, or too many corners to look at.
    """
    plane = _plane(position)
    if len(plane) > MOST_CORNERS or not np.isfinite(plane).all():
        return None
    ring = _Ring(plane.tolist())
    for least in LEAST:
        ring.clip(least)
    return np.array(ring.triangles) if len(ring.triangles) == len(plane) - 2 else None


def _plane(position: np.ndarray) -> np.ndarray:
    """The corners [N] as seen against the polygon's normal, in its size: complex numbers."""
    at = position - position[0]
    at = at / np.abs(at).max()
    normal = np.cross(at, np.roll(at, -1, 0)).sum(0)  # Newell's
    right = np.cross(np.eye(3)[np.abs(normal).argmin()], normal)
    up = np.cross(normal, right)
    x, y = ((at * axis).sum(1) / np.linalg.norm(axis) for axis in (right, up))
    plane: np.ndarray = x + 1j * y  # By no product of matrices: same places must stay the same.
    return plane


def _turn(a: complex, b: complex, c: complex) -> float:
    """Twice the area of a triangle; below zero if it is wound with the clock."""
    return ((b - a).conjugate() * (c - b)).imag


class _Ring:
    """What is left of a polygon in the plane that is wound against the clock.

    Arguments:
        at: The places of its corners.

    Attributes:
        triangles: What has been cut off, by the numbers of corners; in the end, all of it.
    """

    def __init__(self, at: list[complex]) -> None:
        self.at = at
        self.before = [len(at) - 1, *range(len(at) - 1)]
        self.after = [*range(1, len(at)), 0]
        self.left = set(range(len(at)))
        self.triangles: list[tuple[int, int, int]] = []
        self._sort()

    def clip(self, least: float) -> None:
        """Cuts off ears, of at least some area, until there are none.

        What is no ear becomes one only with another neighbour, so these alone are asked again,
        after all others: triangles get less thin. Corners in the same place go first.
        """
        first = sorted(self.left, key=lambda k: self.at[k] != self.at[self.after[k]])
        queue = deque((self.before[k], k, self.after[k]) for k in first)
        while queue and len(self.left) > 2:
            a, b, c = queue.popleft()
            if (self.before[b], self.after[b]) == (a, c) and self._is_ear(a, b, c, least):
                self._cut(a, b, c)
                queue.extend((self.before[k], k, self.after[k]) for k in (a, c))

    def _cut(self, a: int, b: int, c: int) -> None:
        self.triangles.append((a, b, c))
        self.after[a], self.before[c], self.before[b] = c, a, -1
        self.left.remove(b)
        self.bent.discard(b)
        self._look(a)
        self._look(c)
        if 2 * len(self.left) < self.sorted:
            self._sort()

    def _is_ear(self, a: int, b: int, c: int, least: float) -> bool:
        """Whether nothing of the polygon is within the triangle of three corners in a row."""
        p, q, r = self.at[a], self.at[b], self.at[c]
        if p == q or q == r or r == p or len(self.left) == 3:
            return True
        return _turn(p, q, r) >= least and not any(
            _turn(p, q, s) >= -least and _turn(q, r, s) >= -least and _turn(r, p, s) >= -least
            for s in self._near(p, q, r)
            if s not in (p, q, r)
        )

    def _sort(self) -> None:
        """Sorts the bent corners, which alone stand in the way of ears, into a grid."""
        self.sorted = len(self.left)
        self.density = self.sorted**0.5
        self.bent: set[int] = set()
        self.cells: defaultdict[tuple[int, int], list[int]] = defaultdict(list)
        for k in self.left:
            self._look(k)

    def _look(self, k: int) -> None:
        """Finds out whether the polygon turns with the clock at a corner, or not at all."""
        turn = _turn(self.at[self.before[k]], self.at[k], self.at[self.after[k]])
        if turn > ROUNDING:
            self.bent.discard(k)
        elif k not in self.bent:
            self.bent.add(k)
            (x,), (y,) = self._cells(self.at[k])
            self.cells[x, y].append(k)

    def _cells(self, *at: complex) -> tuple[range, range]:
        """Columns and rows of the grid in which some places are."""
        x = [floor(p.real * self.density) for p in at]
        y = [floor(p.imag * self.density) for p in at]
        return range(min(x), max(x) + 1), range(min(y), max(y) + 1)

    def _near(self, *at: complex) -> Iterator[complex]:
        """The places of the bent corners among some places, and of some around."""
        columns, rows = self._cells(*at)
        for cell in product(columns, rows):
            for k in self.cells.get(cell, ()):
                if k in self.bent:
                    yield self.at[k]
