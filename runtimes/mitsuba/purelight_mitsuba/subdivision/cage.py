"""Polygons that are being subdivided, and the sharpness of their edges and vertices."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.int64]
Real = NDArray[np.float64]
INFINITE = 10.0  # Of UsdGeom: this sharp, or sharper, stays sharp at all levels.


@dataclass(frozen=True)
class Cage:
    """Polygons over vertices.

    Arguments:
        counts: [F] corners of each polygon, at least 3.
        vertex: [C] the vertex of each corner, polygon by polygon.
        size: How many vertices there are.
        crease: [N, 2] edges by their vertices.
        crease_sharpness: [N].
        corner_sharpness: [size].
    """

    counts: Index
    vertex: Index
    size: int
    crease: Index
    crease_sharpness: Real
    corner_sharpness: Real

    @cached_property
    def face(self) -> Index:
        """The polygon of each corner: [C]."""
        return np.repeat(np.arange(len(self.counts)), self.counts)

    @cached_property
    def following(self) -> Index:
        """The next corner of the same polygon: [C]."""
        end = np.cumsum(self.counts)
        result = np.arange(1, len(self.vertex) + 1)
        result[end - 1] = end - self.counts
        return result

    @cached_property
    def previous(self) -> Index:
        """The corner before: [C]."""
        result = np.empty_like(self.following)
        result[self.following] = np.arange(len(result))
        return result

    @cached_property
    def _numbered(self) -> tuple[Index, Index]:
        ends = np.sort(np.stack([self.vertex, self.vertex[self.following]], 1), 1)
        key, edge = np.unique(ends[:, 0] * self.size + ends[:, 1], return_inverse=True)
        return np.stack([key // self.size, key % self.size], 1), edge.ravel()

    @property
    def edges(self) -> Index:
        """The vertices of each edge, the lower number first: [E, 2]."""
        return self._numbered[0]

    @property
    def edge(self) -> Index:
        """The edge from each corner to the next: [C]."""
        return self._numbered[1]

    @cached_property
    def edge_faces(self) -> Index:
        """How many polygons meet at each edge: [E]."""
        return np.bincount(self.edge, minlength=len(self.edges))

    @cached_property
    def edge_sharpness(self) -> Real:
        """[E]; infinite at the boundary, and where more than two polygons meet."""
        result = np.zeros(len(self.edges))
        key = self.edges[:, 0] * self.size + self.edges[:, 1]
        ends = np.sort(self.crease, 1)
        wanted = ends[:, 0] * self.size + ends[:, 1]
        at = np.minimum(np.searchsorted(key, wanted), len(key) - 1)
        found = key[at] == wanted
        np.maximum.at(result, at[found], self.crease_sharpness[found])
        result[(result >= INFINITE) | (self.edge_faces != 2)] = np.inf
        return result

    @property
    def vertex_sharpness(self) -> Real:
        """[size]."""
        return np.where(self.corner_sharpness >= INFINITE, np.inf, self.corner_sharpness)

    @cached_property
    def boundary(self) -> NDArray[np.bool_]:
        """Vertices of edges that do not have two polygons: [size]."""
        result = np.zeros(self.size, bool)
        result[self.edges[self.edge_faces != 2]] = True
        return result


def total(index: Index, values: Real, size: int) -> Real:
    """Sums of the rows of values [N, D] that have the same index [N]: [size, D]."""
    columns = [np.bincount(index, column, size) for column in values.T]
    return np.stack(columns, 1) if columns else np.zeros((size, 0))
