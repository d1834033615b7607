"""All rays that leave an exit surface, as points of the unit cube of four dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import disk_to_square, frame, square_to_disk
from purelight_format.namespace import A, namespace
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]
Double = NDArray[np.float64]
Index = NDArray[np.int64]
MORTON_BITS = 10


@dataclass(frozen=True)
class RayChart:
    """Even points of the cube are rays uniform by area and projected solid angle.

    The first coordinate counts area through the sides of the triangles, in an order in which
    neighbours stay near each other, and with the second it is the place in a triangle; the others
    are the concentric square of the projected hemisphere.
    """

    surface: ExitSurface

    @cached_property
    def _order(self) -> Index:
        """The sides of the triangles along the first coordinate: triangle, or T + triangle."""
        normal = self.surface.outward_normals()
        centre = self.surface.positions[self.surface.triangles].mean(1)
        sphere = self.surface.sphere
        cell = (centre - np.asarray(sphere.center)) / (2 * sphere.radius) + 0.5
        near = morton(np.clip(cell * (1 << MORTON_BITS), 0, (1 << MORTON_BITS) - 1))
        backs = np.flatnonzero(self.surface.two_sided)
        facing = [_octant(normal), _octant(-normal[backs])]
        key = np.concatenate(facing) << (3 * MORTON_BITS) | np.concatenate([near, near[backs]])
        side = np.concatenate([np.arange(len(normal)), len(normal) + backs])
        return side[np.argsort(key, kind="stable")]

    @cached_property
    def _ends(self) -> Double:
        """Part of the area up to and with each side of `_order`, after a zero."""
        both = np.tile(self.surface.triangle_area / (1 + self.surface.two_sided), 2)
        sums = np.cumsum(both[self._order])
        return np.concatenate([[0], sums / sums[-1]])

    @cached_property
    def _rank(self) -> Index:
        """Where each side is in `_order`; the back of one-sided triangles is their front: [2 T]."""
        count = len(self.surface.triangles)
        rank = np.full(2 * count, -1)
        rank[self._order] = np.arange(len(self._order))
        return np.where(rank < 0, np.roll(rank, count), rank)

    def place(self, position: Float, normal: Float, outgoing: Float, triangle: Index) -> Double:
        """Points of the cube [N, 4] of rays, three of [N, 3], from their triangles [N]."""
        back = np.einsum("nd,nd->n", normal, self.surface.outward_normals()[triangle]) < 0
        rank = self._rank[triangle + back * len(self.surface.triangles)]
        inside = self.surface.square_of(position, triangle)
        start, end = self._ends[rank], self._ends[rank + 1]
        square = direction_to_square(outgoing.astype(np.float64), normal.astype(np.float64))
        return np.column_stack([start + inside[0] * (end - start), inside[1], square])

    def rays(self, place: Double) -> tuple[Float, Float, Float]:
        """Position, normal and outgoing direction of points of the cube: [N, 4] -> 3 of [N, 3]."""
        rank = np.searchsorted(self._ends, place[:, 0], "right") - 1
        rank = np.clip(rank, 0, len(self._order) - 1)
        start, end = self._ends[rank], self._ends[rank + 1]
        back, triangle = np.divmod(self._order[rank], len(self.surface.triangles))
        inside = np.clip((place[:, 0] - start) / np.maximum(end - start, 1e-300), 0, 1)
        position = self.surface.points_of(triangle, np.stack((inside, place[:, 1])))
        normal = self.surface.outward_normals()[triangle] * np.where(back, -1, 1)[:, None]
        disk, (tangent, bitangent) = square_to_disk(place[:, 2:]), frame(normal)
        up = np.sqrt(np.maximum(1 - (disk**2).sum(1, keepdims=True), 1e-12))
        outgoing = disk[:, :1] * tangent + disk[:, 1:] * bitangent + up * normal
        return position, normal.astype(np.float32), outgoing.astype(np.float32)


def direction_to_square(outgoing: A, normal: A) -> A:
    """Outgoing directions about normals on the square of the projected hemisphere: [N, 2].

    Area on the unit disk is projected solid angle, so a density p on the square is
    `pdf_projected = p / pi`. Arrays or tensors, two of [N, 3].
    """
    xp = namespace(normal)
    disk: A = xp.concat([xp.sum(outgoing * side) for side in frame(normal)])
    return disk_to_square(disk)


def morton(cell: Double) -> Index:
    """Morton codes of cells [N, 3] below 2^`MORTON_BITS`: [N]."""
    whole, code = cell.astype(np.int64), np.zeros(len(cell), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= (whole[:, axis] >> bit & 1) << (3 * bit + axis)
    return code


def _octant(normal: Double) -> Index:
    """0 to 7 by the signs of vectors [N, 3]."""
    return (normal > 0) @ np.array([1, 2, 4])
