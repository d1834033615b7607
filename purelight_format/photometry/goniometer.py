"""Tables that were measured about another axis: LM-63 types A and B as type C.

The beam axis (both angles 0) becomes nadir. In LM-63 photometric horizontal is at H 0, V 90 of type
B and lies in the plane of zero degrees of type C: the vertical angle turns towards +X (C0), the
horizontal one, clockwise, towards -Y (C270). EN 13032-1 has its B planes a quarter turn from there.
"""

from __future__ import annotations

import numpy as np

from purelight_format.photometry.table import IntensityTable, bilinear

TYPE_C, TYPE_B, TYPE_A = 1, 2, 3
LEAST_STEP, LARGEST_STEP = 0.5, 2.5


def as_type_c(
    kind: int, vertical: np.ndarray, horizontal: np.ndarray, candela: np.ndarray
) -> IntensityTable:
    """A table of any type as one of type C.

    Arguments:
        kind: `TYPE_A`, `TYPE_B` or `TYPE_C`.
        vertical, horizontal: [V], [H] degrees, rising; angles of types A and B that begin with 0
            stand for both sides.
        candela: [H, V].
    """
    if kind == TYPE_C:
        return IntensityTable(vertical, horizontal, candela)
    horizontal, candela = _both_sides(horizontal, candela)
    vertical, rotated = _both_sides(vertical, candela.T)
    polar, azimuth = _nodes(vertical, horizontal)
    up, across = _angles_of(kind, *np.meshgrid(polar, azimuth))
    inside = (up >= vertical[0]) & (up <= vertical[-1])
    inside &= (across >= horizontal[0]) & (across <= horizontal[-1])
    value = bilinear(horizontal, vertical, rotated.T, across.ravel(), up.ravel())
    return IntensityTable(polar, azimuth, np.where(inside, value.reshape(up.shape), 0.0))


def _both_sides(angle: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles -90 .. 90 from those of one side, which begin with 0."""
    if angle[0] != 0:
        return angle, rows
    return np.concatenate([-angle[:0:-1], angle]), np.concatenate([rows[:0:-1], rows])


def _nodes(*axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polar and azimuthal nodes, as fine as the finest step of the file within bounds."""
    finest = min((np.diff(axis).min() for axis in axes if len(axis) > 1), default=LARGEST_STEP)
    step = float(np.clip(finest, LEAST_STEP, LARGEST_STEP))
    return np.linspace(0, 180, round(180 / step) + 1), np.linspace(0, 360, 145)


def _angles_of(kind: int, polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertical and horizontal angles of types A and B of directions of type C, in degrees."""
    theta, phi = np.radians(polar), np.radians(azimuth)
    x, y = np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi)
    down = np.cos(theta)
    if kind == TYPE_A:
        return np.degrees(np.arcsin(np.clip(x, -1, 1))), np.degrees(np.arctan2(-y, down))
    return np.degrees(np.arctan2(x, down)), np.degrees(np.arcsin(np.clip(-y, -1, 1)))
