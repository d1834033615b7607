"""Far-field intensity of a lamp, by counting the light that escapes it into each direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator

from purelight_train.light.direction_zones import zone_of
from purelight_train.light.exit_records import ExitRecords

Table = NDArray[np.float64]


@dataclass(frozen=True)
class IntensityZones:
    """Mean radiant intensity in zones of equal solid angle (`direction_zones`).

    Arguments:
        intensity, error: [rows, columns, 3] in W/sr and its standard error.
    """

    intensity: Table
    error: Table

    @staticmethod
    def of(records: ExitRecords, rows: int = 16, columns: int = 12) -> IntensityZones:
        """Count exit records."""
        zone, zones = zone_of(records.direction, rows, columns), rows * columns
        weight = records.weight.astype(np.float64) * (zones / (4 * np.pi))
        first, second = (
            np.stack([np.bincount(zone, w[:, c], zones) for c in range(3)], 1) / records.paths
            for w in (weight, weight**2)
        )
        error = np.sqrt(np.maximum(second - first**2, 0) / records.paths)
        shape = (rows, columns, 3)
        return IntensityZones(first.reshape(shape), error.reshape(shape))

    def directions(self, side: int = 8) -> NDArray[np.float64]:
        """Directions that fill each zone evenly: [rows, columns, side², 3]."""
        rows, columns = self.intensity.shape[:2]
        at = (np.arange(side) + 0.5) / side
        z = (np.arange(rows)[:, None] + at) / rows * 2 - 1
        phi = (np.arange(columns)[:, None] + at) / columns * 2 * np.pi
        shape = (rows, columns, side, side)
        z = np.broadcast_to(z[:, None, :, None], shape)
        phi = np.broadcast_to(phi[None, :, None, :], shape)
        sine = np.sqrt(1 - z**2)
        direction = np.stack((sine * np.cos(phi), sine * np.sin(phi), z), -1)
        return direction.reshape(rows, columns, side**2, 3)


def interpolate(vertical: Table, horizontal: Table, values: Table, direction: Table) -> Table:
    """A photometric table of type C along directions, linear between its nodes.

    Arguments:
        vertical: [V] degrees from -Z.
        horizontal: [H] degrees from +X, both ends of the circle.
        values: [H, V, C].
        direction: [..., 3] unit vectors.

    Returns:
        [..., C].
    """
    x, y, z = np.moveaxis(direction, -1, 0)
    polar = np.degrees(np.arctan2(np.hypot(x, y), -z))
    azimuth = np.degrees(np.arctan2(y, x)) % 360
    table = RegularGridInterpolator((horizontal, vertical), values)
    result: Table = table(np.stack((azimuth, polar), -1))
    return result
