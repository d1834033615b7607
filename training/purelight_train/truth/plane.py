"""Irradiance that a lamp casts on a plane, straight from its exit records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere
from purelight_train.light.exit_records import ExitRecords

Image = NDArray[np.float64]


@dataclass(frozen=True)
class Plane:
    """A horizontal square that faces up, centred under a lamp.

    Arguments:
        center: [3] in metres.
        side: edge length in metres.
        cells: cells along each edge.
    """

    center: tuple[float, float, float]
    side: float
    cells: int

    @staticmethod
    def below(sphere: BoundingSphere, distance: float = 1.0, side: float = 2.0) -> Plane:
        """The plane `distance` metres below the lamp's centre, 16x16 cells."""
        x, y, z = sphere.center
        return Plane((x, y, z - distance), side, 16)


def plane_irradiance(records: ExitRecords, plane: Plane) -> tuple[Image, Image]:
    """Irradiance of escaped light on a plane, straight from the exit records.

    Returns:
        irradiance and its standard error in W/m² per channel, two of [cells, cells, 3] indexed
        by [y, x].
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (plane.center[2] - records.position[:, 2]) / records.direction[:, 2]
        at = records.position + t[:, None] * records.direction - np.asarray(plane.center)
    unit = at[:, :2] / plane.side + 0.5
    hit = (t > 0) & (unit >= 0).all(1) & (unit < 1).all(1)
    cell = np.floor(unit[hit] * plane.cells).astype(np.int64)
    index = cell[:, 1] * plane.cells + cell[:, 0]
    weight = records.weight[hit].astype(np.float64) / (plane.side / plane.cells) ** 2
    sums = [
        np.stack([np.bincount(index, w[:, c], plane.cells**2) for c in range(3)], 1)
        for w in (weight, weight**2)
    ]
    mean = sums[0] / records.paths
    error = np.sqrt(np.maximum(sums[1] / records.paths - mean**2, 0) / records.paths)
    shape = (plane.cells, plane.cells, 3)
    return mean.reshape(shape), error.reshape(shape)
