"""Vertices of a triangle mesh that may go to a neighbour, and what that changes around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Float = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
CHUNK = 1 << 18  # ways that are weighed at a time
NEEDLE = 0.02  # height over length of a triangle that is not made thinner


@dataclass(frozen=True)
class Mesh:
    """Triangles over positions [V, 3].

    Arguments:
        corners: [T, 3].
        number: [T] of each in the mesh as it was.
        label: [T]; borders between labels are kept as those of the mesh are.
        normal: [T, 3] unit normals, as they were.
        tolerance: [T] how far it may come to be.
    """

    positions: Float
    corners: Index
    number: Index
    label: Index
    normal: Float
    tolerance: Float

    def take(self, chosen: Mask) -> Mesh:
        """The triangles where a mask [T] is true."""
        names = ("corners", "number", "label", "normal", "tolerance")
        return Mesh(self.positions, *(getattr(self, name)[chosen] for name in names))


@dataclass(frozen=True)
class Ways:
    """Vertices that may go to a neighbour: `start`, `end` and the deviation of each: [N]."""

    start: Index
    end: Index
    cost: Float

    def take(self, chosen: NDArray[Any]) -> Ways:
        return Ways(self.start[chosen], self.end[chosen], self.cost[chosen])


def beside_line(positions: Float, point: Index, a: Index, b: Index) -> Float:
    """The distance of points from the segments from a to b: [N]."""
    p, start, way = positions[point], positions[a], positions[b] - positions[a]
    square = np.maximum(np.einsum("nd,nd->n", way, way), 1e-300)
    part = np.clip(np.einsum("nd,nd->n", p - start, way) / square, 0, 1)
    result: Float = np.linalg.norm(p - start - part[:, None] * way, axis=1)
    return result


def weighed(mesh: Mesh, ways: Ways, cosine: float) -> Ways:
    """The ways that are allowed, with what they move at most."""
    stars = Stars.of(mesh)
    good, cost = np.zeros(len(ways.start), bool), ways.cost.copy()
    for begin in range(0, len(cost), CHUNK):
        part = slice(begin, begin + CHUNK)
        row, right, away = stars.moved(ways.start[part], ways.end[part], cosine)
        count = len(ways.start[part])
        good[part] = (np.bincount(row, minlength=count) > 0) & (
            np.bincount(row, ~right, count) == 0
        )
        np.maximum.at(cost[part], row, away)
    good &= cost <= stars.slack[ways.start]
    return ways.take(good)


@dataclass(frozen=True)
class Stars:
    """The triangles around each vertex.

    Arguments:
        corner: [3 T] corners of triangles in the order of their vertices; first, number: [V] where
            those of a vertex begin and how many there are.
        slack: [V] the least tolerance of them.
        place: [3, V]; was, now: [3, T] normals of the triangles; height: [T] over their length.
    """

    mesh: Mesh
    corner: Index
    first: Index
    number: Index
    slack: Float
    place: Float
    was: Float
    now: Float
    height: Float

    @staticmethod
    def of(mesh: Mesh) -> Stars:
        corner = np.argsort(mesh.corners, axis=None, kind="stable")
        number = np.bincount(mesh.corners.ravel(), minlength=len(mesh.positions))
        first = np.cumsum(number) - number
        used, triangle = number > 0, corner // 3
        slack = np.zeros(len(number))
        slack[used] = np.minimum.reduceat(mesh.tolerance[triangle], first[used])
        place, was = (np.ascontiguousarray(x.T) for x in (mesh.positions, mesh.normal))
        now, height = _cross(*(place[:, k] for k in mesh.corners.T))
        return Stars(mesh, corner, first, number, slack, place, was, now, height)

    def moved(self, start: Index, end: Index, cosine: float) -> tuple[Index, Mask, Float]:
        """The triangles that are left around vertices [N] which go to others.

        Returns:
            which vertex each is of, whether it faces as before, how far its plane is from it.
        """
        number = self.number[start]
        row = np.repeat(np.arange(len(start)), number)
        within = np.arange(len(row)) - np.repeat(np.cumsum(number) - number, number)
        corner = self.corner[self.first[start][row] + within]
        triangle, k = np.divmod(corner, 3)
        b, c = (self.mesh.corners[triangle, (k + turn) % 3] for turn in (1, 2))
        left = (b != end[row]) & (c != end[row])
        row, triangle, b, c = row[left], triangle[left], b[left], c[left]
        goal = self.place[:, end[row]]
        normal, height = _cross(goal, self.place[:, b], self.place[:, c])
        right = _dot(normal, self.was[:, triangle]) >= cosine
        right &= _dot(normal, self.now[:, triangle]) > 0
        right &= height >= np.minimum(NEEDLE, 0.5 * self.height[triangle])
        return row, right, np.abs(_dot(self.place[:, start[row]] - goal, normal))


def _cross(a: Float, b: Float, c: Float) -> tuple[Float, Float]:
    """Unit normals [3, N] of triangles with corners [3, N], and their height over their length."""
    u, v, w = b - a, c - a, c - b
    cross = np.stack([
        u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]
    ])  # fmt: skip
    twice = np.sqrt(_dot(cross, cross))
    longest = np.maximum(np.maximum(_dot(u, u), _dot(v, v)), _dot(w, w))
    return cross / np.maximum(twice, 1e-300), twice / np.maximum(longest, 1e-300)


def _dot(a: Float, b: Float) -> Float:
    result: Float = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    return result
