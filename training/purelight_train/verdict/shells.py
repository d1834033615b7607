"""Spheres around a lamp, in cells of equal area that face its centre: where its light arrives."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere, disk_to_square, square_to_disk

RADII = (2.0, 5.0, 12.0)  # where floors, walls and ceilings are, in the lamp's radii
SIDE = 32  # cells along each side of a half's square, 4.5 degrees each
Image = NDArray[np.float64]


@dataclass(frozen=True)
class Shells:
    """The spheres of one lamp, each two halves, below first, as equal-area squares.

    What is counted on them has the form of a picture, [spheres * 2 * SIDE, SIDE, 3].
    """

    sphere: BoundingSphere
    radii: tuple[float, ...] = RADII

    @property
    def cell_areas(self) -> Image:
        """Area of a cell on each sphere: [spheres] in m²."""
        distance = np.asarray(self.radii) * self.sphere.radius
        areas: Image = 4 * math.pi * distance**2 / (2 * SIDE * SIDE)
        return areas

    def caught(self, position: NDArray[Any], direction: NDArray[Any], power: NDArray[Any]) -> Image:
        """Sums of the power that rays from within the lamp's sphere bring to each cell, in W.

        Arguments:
            position, direction, power: three of [N, 3]; directions are unit vectors.
        """
        start = (position - np.asarray(self.sphere.center)) / self.sphere.radius
        along = np.einsum("nd,nd->n", start, direction)
        off = np.einsum("nd,nd->n", start, start) - along**2
        sums = []
        for radius in self.radii:
            reach = np.sqrt(np.maximum(radius**2 - off, 0)) - along
            cell = cells((start + reach[:, None] * direction) / radius)
            sums += [_counted(cell, power[:, c]) for c in range(3)]
        total: Image = np.stack(sums, 0).reshape(len(self.radii), 3, -1)
        return as_picture(np.moveaxis(total, 1, 2))

    def points(self, rng: np.random.Generator) -> NDArray[np.float32]:
        """A random point in each cell of every sphere: [spheres, 2 * SIDE², 3]."""
        row, column = np.mgrid[0:SIDE, 0:SIDE].reshape(2, -1)
        corner = np.stack((column, row), -1)
        halves = [
            _directions((corner + rng.random(corner.shape)) / SIDE, up)
            for _ in self.radii
            for up in (-1, 1)
        ]
        unit = np.stack(halves).reshape(len(self.radii), -1, 3)
        distance = np.asarray(self.radii)[:, None, None] * self.sphere.radius
        return (np.asarray(self.sphere.center) + distance * unit).astype(np.float32)

    def height(self) -> Image:
        """The cosine of each cell's middle with +Z, in the form of a picture: [..., SIDE, 1]."""
        row, column = np.mgrid[0:SIDE, 0:SIDE].reshape(2, -1)
        middle = (np.stack((column, row), -1) + 0.5) / SIDE
        halves = [_directions(middle, up)[:, 2:] for up in (-1, 1)]
        return as_picture(np.stack([np.concatenate(halves)] * len(self.radii)))


def as_picture(cells: Image) -> Image:
    """Values of [spheres, 2 * SIDE², C] in the form of a picture, [spheres * 2 * SIDE, SIDE, C]."""
    return np.ascontiguousarray(cells).reshape(-1, SIDE, cells.shape[-1])


def cells(unit: NDArray[Any]) -> NDArray[np.int64]:
    """Which of the 2 * SIDE² cells unit vectors [N, 3] point to: [N]."""
    disk = unit[:, :2] / np.sqrt(1 + np.abs(unit[:, 2:]))
    place = np.minimum((disk_to_square(disk) * SIDE).astype(np.int64), SIDE - 1)
    half = (unit[:, 2] > 0).astype(np.int64)
    cell: NDArray[np.int64] = (half * SIDE + place[:, 1]) * SIDE + place[:, 0]
    return cell


def _directions(square: Image, up: int) -> Image:
    """Unit vectors of places in the square of a half sphere: [N, 2] to [N, 3]."""
    disk = square_to_disk(square)
    m = (disk**2).sum(1, keepdims=True)
    unit: Image = np.concatenate([disk * np.sqrt(2 - m), up * (1 - m)], 1)
    return unit


def _counted(cell: NDArray[np.int64], power: NDArray[Any]) -> Image:
    sums = np.bincount(cell, power.astype(np.float64), 2 * SIDE * SIDE)
    return sums.astype(np.float64)
