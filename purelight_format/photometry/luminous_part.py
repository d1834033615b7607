"""The luminous opening of a triangle mesh, from the flux of its triangles."""

from __future__ import annotations

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.photometry.opening import BALL, BOX, DRUM, POINT, Opening

SHARE = 0.99  # Of the light, from the brightest triangles on, that the opening is to send out.
ROUND = 1.05  # Square of the distance from the axis, of a unit circle; a box has 2.


def luminous_opening(
    positions: np.ndarray, triangles: np.ndarray, triangle_flux: np.ndarray
) -> Opening:
    """The upright body around the triangles that light comes from; a point for a dark mesh.

    Arguments:
        positions: [V, 3] in metres.
        triangles: [T, 3].
        triangle_flux: [T, 3] W per channel.
    """
    corner = positions.astype(np.float64)[triangles]
    a, b, c = np.moveaxis(corner, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    light = triangle_flux.astype(np.float64) @ LUMINANCE
    order = np.argsort(-light / np.maximum(area, 1e-300))
    before = np.cumsum(light[order]) - light[order]
    lit = corner[order[(before < SHARE * light.sum()) & (light[order] > 0)]].reshape(-1, 3)
    if not len(lit):
        return POINT
    low, high = lit.min(0), lit.max(0)
    half = np.maximum((high - low) / 2, 1e-12)
    unit = ((lit - (low + high) / 2) / half) ** 2
    around = float(unit[:, :2].sum(1).max())
    shape = BALL if unit.sum(1).max() <= ROUND else DRUM if around <= ROUND else BOX
    width, length, height = (float(size) for size in high - low)
    return Opening(width, length, (height,) * 4, shape)
