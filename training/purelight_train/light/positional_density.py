"""Positional density of exit records by photon mapping (paper Eq. 8), per channel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]
QUERY_BATCH = 1 << 18
MAX_CELLS = 192
FEWEST = 4  # points of area
ALIKE_COSINE = 0.5


class NeighbourSum:
    """Sums of RGB weights over points within a radius, for points sorted into a uniform grid.

    A neighbour counts if its normal is within 60 degrees of the query's. The paper tests the
    photon's direction against the query's hemisphere, which lets the light of one side of an
    edge leak onto the other: 4% too much on a cube.

    Arguments:
        position, normal, weight: [N, 3] of the points to be summed.
        radius: of the neighbourhood, in metres.
    """

    def __init__(self, position: Float, normal: Float, weight: Float, radius: float) -> None:
        low, high = position.min(0) - radius, position.max(0) + radius
        self.radius = radius
        self.cell = np.maximum(radius, (high - low).max() / MAX_CELLS)
        self.low = low
        self.shape = np.maximum(np.ceil((high - low) / self.cell).astype(np.int64), 1)
        index = self._cell_index(position)
        order = np.argsort(index, kind="stable")
        count = np.bincount(index, minlength=int(self.shape.prod()))
        self.start = mi.UInt32(np.concatenate(([0], np.cumsum(count))).astype(np.uint32))
        self.position, self.normal, self.weight = (
            mi.Float(np.ravel(a[order])) for a in (position, normal, weight)
        )

    def _cell_index(self, position: Float) -> NDArray[np.int64]:
        cell = np.floor((position - self.low) / self.cell).astype(np.int64)
        cell = np.clip(cell, 0, self.shape - 1)
        return cell[:, 0] + self.shape[0] * (cell[:, 1] + self.shape[1] * cell[:, 2])

    def __call__(self, position: Float, normal: Float) -> NDArray[np.float32]:
        """Sum of weights around each query [M, 3] with unit normal [M, 3]: [M, 3]."""
        order = np.argsort(self._cell_index(position))
        result = np.empty((len(position), 3), np.float32)
        for i in range(0, len(order), QUERY_BATCH):
            part = order[i : i + QUERY_BATCH]
            total = self._sum(
                mi.Point3f(np.ascontiguousarray(position[part].T)),
                mi.Normal3f(np.ascontiguousarray(normal[part].T)),
            )
            result[part] = np.array(total).T
        return result

    @dr.syntax
    def _sum(self, point: mi.Point3f, normal: mi.Normal3f) -> mi.Color3f:
        cell = mi.Vector3i((point - mi.ScalarPoint3f(*map(float, self.low))) / float(self.cell))
        nx, ny, nz = (int(n) for n in self.shape)
        x0 = dr.clip(cell.x - 1, 0, nx - 1)
        x1 = dr.clip(cell.x + 1, 0, nx - 1)
        total = mi.Color3f(0)
        row = mi.Int32(0)
        # Nine rows of three cells; a row's points are contiguous
        while row < 9:
            y, z = cell.y + row % 3 - 1, cell.z + row // 3 - 1
            inside = (y >= 0) & (y < ny) & (z >= 0) & (z < nz)
            base = nx * (y + ny * z)
            i = dr.gather(mi.UInt32, self.start, mi.UInt32(base + x0), inside)
            end = dr.gather(mi.UInt32, self.start, mi.UInt32(base + x1 + 1), inside)
            while i < end:
                offset = dr.gather(mi.Point3f, self.position, i) - point
                own_normal = dr.gather(mi.Normal3f, self.normal, i)
                near = dr.squared_norm(offset) < self.radius**2
                near &= dr.dot(own_normal, normal) > ALIKE_COSINE
                total += dr.select(near, dr.gather(mi.Color3f, self.weight, i), 0)
                i += 1
            row += 1
        return total


@dataclass(frozen=True)
class PositionalDensity:
    r"""Exitant power per area, :math:`\Phi\,p_{pos}(x)`, from photons within a radius (Eq. 8).

    Eq. 8 divides by the disc's area pi r². Near edges the surface within r is smaller or larger
    than a disc; the area is therefore estimated from points uniform on the surface with the same
    neighbour rule, which equals pi r² on flat ground and removes the bias at edges. The points
    are spread evenly, or their noise would add as much again as the photons'.

    Attributes:
        least_area: that a place is taken to have, of a few points: a small bare emitter in a large
            lamp is far smaller than the disc.
    """

    photons: NeighbourSum
    area: NeighbourSum
    radius: float
    least_area: float

    @staticmethod
    def build(
        records: ExitRecords, surface: ExitSurface, neighbours: int, rng: np.random.Generator
    ) -> PositionalDensity:
        """Choose the radius so that a disc of average density holds `neighbours` photons.

        The noise is 1 / sqrt(neighbours), whatever the lamp; the bias grows with the radius.
        `benchmarks/photon_map_radius.py` measures both on a lamp of known exitance: a radius of
        0.05 of the lamp's has a bias below one percent, so that for any number of photons above
        a million, a thousand neighbours (3% noise) are still limited by noise. Smaller radii only
        show more noise, unless the exit surface has features smaller than that.
        """
        radius = math.sqrt(neighbours * surface.area / (math.pi * len(records)))
        photons = NeighbourSum(
            records.position, records.normal,
            (records.weight / records.paths).astype(np.float32), radius,
        )  # fmt: skip
        count = len(records)
        point, normal = surface.sample_evenly(count, rng)
        weight = np.full((count, 3), surface.area / count, np.float32)
        area = NeighbourSum(point, normal, weight, radius)
        return PositionalDensity(photons, area, radius, FEWEST * surface.area / count)

    def exitance(self, position: Float, normal: Float) -> NDArray[np.float32]:
        """Power per area in W/m² per channel at [M, 3] with normals [M, 3]: [M, 3]."""
        power = self.photons(position, normal)
        area = self.area(position, normal)
        return (power / np.maximum(area, self.least_area)).astype(np.float32)
