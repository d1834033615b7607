"""The figures by which lighting people know a light distribution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.photometry.table import IntensityTable

STEP = 0.25  # Degrees.
PLANES = (("C0-C180", 0.0), ("C90-C270", 90.0))


@dataclass(frozen=True)
class Figures:
    """Of one distribution.

    Arguments:
        flux: lm.
        peak: largest intensity in cd.
        toward: its direction: degrees from nadir, and plane C.
        beam, field: by plane, the angle between the outermost directions that have half, and a
            tenth, of the plane's largest intensity; 360 if all have.
        downward: part of the flux below the horizon.
    """

    flux: float
    peak: float
    toward: tuple[float, float]
    beam: dict[str, float]
    field: dict[str, float]
    downward: float

    @staticmethod
    def of(table: IntensityTable) -> Figures:
        """The figures of a table."""
        around, planes = table.whole
        row, column = np.unravel_index(planes.argmax(), planes.shape)
        toward = float(table.vertical[column]), float(around[row] % 360)
        angles = {
            share: {name: _angle(table, plane, share) for name, plane in PLANES}
            for share in (0.5, 0.1)
        }
        return Figures(
            table.flux, float(planes.max()), toward, angles[0.5], angles[0.1], _downward(table)
        )  # fmt: skip


def profile(table: IntensityTable, plane: float, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles -180 .. 180 degrees from nadir, and the intensities there.

    Positive angles lie in plane C, negative ones in the opposite plane.
    """
    angle = np.linspace(-180, 180, round(360 / step) + 1)
    side = np.where(angle < 0, plane + 180, plane)
    return angle, table.at(np.abs(angle), side)


def _angle(table: IntensityTable, plane: float, share: float) -> float:
    """The angle between the outermost directions of a plane with a share of its peak."""
    angle, value = profile(table, plane, STEP)
    level = share * value.max()
    lit = np.flatnonzero(value >= level)
    if not value.max() > 0:
        return 0.0
    ends = [float(angle[lit[0]]), float(angle[lit[-1]])]
    for side, (inner, outer) in enumerate(((lit[0], lit[0] - 1), (lit[-1], lit[-1] + 1))):
        if 0 <= outer < len(angle):
            part = (value[inner] - level) / (value[inner] - value[outer])
            ends[side] += float(part * (angle[outer] - angle[inner]))
    return ends[1] - ends[0]


def _downward(table: IntensityTable) -> float:
    total = table.flux
    below = np.unique(np.append(table.vertical[table.vertical < 90], 90.0))
    part = IntensityTable(below, table.whole[0], table.resampled(below, table.whole[0]))
    return part.flux / total if total > 0 else 0.0
