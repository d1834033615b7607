"""Bins of light on a box: place on a face, and direction on the square of its hemisphere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from purelight_format.measures import disk_to_square
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface

Double = NDArray[np.float64]
FACES = 6  # +x, -x, +y, -y, +z, -z
MARGIN = 1.002  # of the box over the lamp's bounds
PATCHES = 16  # squares along a side of a face, whose flux chooses where samples go


@dataclass(frozen=True)
class Box:
    """An axis-aligned box. The axes of the face across axis k are k + 1 and k + 2, cyclically.

    Arguments:
        centre, half: [3] in m.
    """

    centre: Double
    half: Double

    @staticmethod
    def around(surface: ExitSurface) -> Box:
        """The lamp's bounds, a little larger."""
        low, high = (f(surface.positions.astype(np.float64), axis=0) for f in (np.min, np.max))
        least = 0.05 * float((high - low).max())  # a flat lamp has sides nevertheless
        return Box(0.5 * (low + high), MARGIN * np.maximum(0.5 * (high - low), least))

    @staticmethod
    def of(surface: ExitSurface) -> Box:
        """The box whose faces a surface is."""
        low, high = (f(surface.positions.astype(np.float64), axis=0) for f in (np.min, np.max))
        return Box(0.5 * (low + high), 0.5 * (high - low))

    @property
    def areas(self) -> Double:
        """Of the faces in m²: [6]."""
        x, y, z = 2 * self.half
        return np.repeat([y * z, z * x, x * y], 2)

    def mesh(self) -> trimesh.Trimesh:
        """The faces in squares, as triangles wound outwards."""
        step = np.linspace(-1, 1, PATCHES + 1)
        v, u = (a.ravel() for a in np.meshgrid(step, step, indexing="ij"))
        i, j = (a.ravel() for a in np.meshgrid(*2 * [np.arange(PATCHES)], indexing="ij"))
        first, row = i * (PATCHES + 1) + j, PATCHES + 1
        square = np.stack((first, first + 1, first + row + 1, first + row), 1)
        faces = np.concatenate((square[:, [0, 1, 2]], square[:, [0, 2, 3]]))
        parts = []
        for face in range(FACES):
            axis, sign = face // 2, 1 - 2 * (face % 2)
            corners = np.empty((len(u), 3))
            corners[:, axis] = sign
            corners[:, (axis + 1) % 3], corners[:, (axis + 2) % 3] = u, v
            turned = faces if sign > 0 else faces[:, ::-1]
            parts.append(trimesh.Trimesh(corners * self.half + self.centre, turned, process=False))
        return trimesh.util.concatenate(parts)


@dataclass(frozen=True)
class Bins:
    """Radiance in W/(m² sr) in bins of equal area and projected solid angle of each face.

    Arguments:
        values: [6, places, places, directions, directions, 3].
    """

    box: Box
    values: Double

    @property
    def places(self) -> int:
        return self.values.shape[1]

    @property
    def directions(self) -> int:
        return self.values.shape[3]

    @property
    def flux(self) -> Double:
        """In W: [3]."""
        cell = self.box.areas * np.pi / (self.places * self.directions) ** 2
        return np.einsum("f,fuvabc->c", cell, self.values)

    @staticmethod
    def of(box: Box, records: ExitRecords, places: int, directions: int) -> Bins:
        """Count the light of records that were settled on the box."""
        shape = (FACES, places, places, directions, directions)
        out = records.take(records.escaped)
        face, square = coordinates(box, out.position, out.normal, out.direction)
        counts = np.array((places, places, directions, directions))
        cell = np.minimum((square * counts).astype(int), counts - 1)
        index = np.ravel_multi_index((face, *cell.T), shape)
        power = [np.bincount(index, w, int(np.prod(shape))) for w in out.weight.T]
        total = np.stack(power, -1).reshape(*shape, 3) / out.paths
        size = box.areas * np.pi / (places * directions) ** 2
        return Bins(box, total / size[:, None, None, None, None, None])

    def filtered(self, sigma: float) -> Bins:
        """Blurred in four dimensions by a Gaussian of so many bins, face by face."""
        if sigma <= 0:
            return self
        axes = (sigma,) * 4 + (0.0,)
        blurred = [gaussian_filter(face, axes, mode="nearest") for face in self.values]
        return replace(self, values=np.stack(blurred)).scaled(self.flux)

    def scaled(self, flux: Double) -> Bins:
        """Without negative radiance, and of this flux."""
        lit = replace(self, values=np.maximum(self.values, 0))
        now = lit.flux
        factor = np.divide(flux, now, out=np.zeros(3), where=now > 0)
        return replace(lit, values=lit.values * factor)


def coordinates(
    box: Box, position: NDArray[np.float32], normal: NDArray[np.float32],
    outgoing: NDArray[np.float32],
) -> tuple[NDArray[np.int64], Double]:  # fmt: skip
    """Face [N] and coordinates in [0, 1]: place, then direction [N, 4]."""
    axis = np.abs(normal).argmax(1)
    rows = np.arange(len(axis))
    face = 2 * axis + (normal[rows, axis] < 0)
    unit = (position - box.centre) / box.half
    along = ((axis + 1) % 3, (axis + 2) % 3)
    place = np.stack([unit[rows, k] for k in along], 1) * 0.5 + 0.5
    disk = np.stack([outgoing[rows, k] for k in along], 1).astype(np.float64)
    return face, np.clip(np.concatenate((place, disk_to_square(disk)), 1), 0, 1)
