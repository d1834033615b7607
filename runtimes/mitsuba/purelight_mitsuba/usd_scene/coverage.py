"""Whether texture coordinates show each place of a picture once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
RASTER = 256
MOST = 4096  # Triangles that are looked at


def one_to_one(uv: NDArray[np.floating]) -> bool:
    """Whether triangles [T, 3, 2] lie within the unit square, have area, and do not overlap.

    Overlaps are looked for at the centres of 256 x 256 cells. More than 4,096 triangles are taken
    to overlap.
    """
    if len(uv) > MOST or not ((uv >= -1e-6) & (uv <= 1 + 1e-6)).all():
        return False
    corners = uv.astype(np.float64)
    if not (np.abs(_area(corners[:, 0], corners[:, 1], corners[:, 2])) > 0).all():
        return False
    covered = np.zeros((RASTER, RASTER), np.int64)
    for triangle in corners:
        low = np.floor(triangle.min(0) * RASTER).clip(0, RASTER).astype(int)
        high = np.ceil(triangle.max(0) * RASTER).clip(0, RASTER).astype(int)
        x, y = ((np.arange(a, b) + 0.5) / RASTER for a, b in zip(low, high, strict=True))
        place = np.stack(np.meshgrid(x, y), -1)
        covered[low[1] : high[1], low[0] : high[0]] += _inside(place, triangle)
    return bool(covered.max() <= 1)


def _inside(place: Floats, triangle: Floats) -> NDArray[np.bool_]:
    """Which places [..., 2] lie inside, those on an edge excepted."""
    a, b, c = triangle
    sides = np.stack([_area(p, q, place) for p, q in ((a, b), (b, c), (c, a))])
    result: NDArray[np.bool_] = (
        np.abs(np.sign(np.where(np.abs(sides) < 1e-12, 0, sides)).sum(0)) == 3
    )
    return result


def _area(a: Floats, b: Floats, c: Floats) -> Floats:
    """Twice the signed area."""
    u, v = b - a, c - a
    result: Floats = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return result
