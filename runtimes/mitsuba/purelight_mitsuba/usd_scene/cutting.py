"""Polygons cut into triangles."""

from __future__ import annotations

import numpy as np

from purelight_mitsuba.usd_scene.corners import fans
from purelight_mitsuba.usd_scene.ears import ears

ROUNDING = 1e-6  # Of a polygon's area, up to which a fan may fold back.
BETTER = 0.01  # Of what a fan folds back: triangles that do so by less are taken instead.
BLOCK = 1 << 17  # Polygons at a time, which bounds the memory.
FAN, OTHER_DIAGONAL = np.array([[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]])


def cut(
    counts: np.ndarray, vertex: np.ndarray, position: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Polygon [T] and corners [T, 3] (into the index list) of triangles that fill each polygon.

    They are a fan unless that leaves the polygon, as seen along its normal.

    Arguments:
        counts: [F] corners of each polygon; fewer than three make no triangle.
        vertex: [C] the vertex of each corner.
        position: [V, 3] of the vertices.
    """
    face, corner = fans(counts)
    if not (counts > 3).any():
        return face, corner
    ends = np.concatenate([[0], np.cumsum(np.maximum(counts - 2, 0))])
    for low in range(0, len(counts), BLOCK):
        some = counts[low : low + BLOCK]
        part = slice(ends[low], ends[low + len(some)])
        with np.errstate(all="ignore"):  # Polygons whose places are no numbers stay fans.
            corner[part] = _mended(some, face[part] - low, corner[part], vertex, position)
    return face, corner


def _mended(
    counts: np.ndarray,
    face: np.ndarray,
    corner: np.ndarray,
    vertex: np.ndarray,
    position: np.ndarray,
) -> np.ndarray:
    """Fans [T, 3], or other triangles of those polygons that their fans leave."""
    folded = _folded(face, position[vertex[corner]], len(counts))
    bad = np.flatnonzero(folded > ROUNDING)
    if not len(bad):
        return corner
    rows = np.isin(face, bad)
    number = np.repeat(np.arange(len(bad)), counts[bad] - 2)
    first = corner[np.searchsorted(face, bad), 0]
    others = [_other(position[vertex[k : k + n]]) for k, n in zip(first, counts[bad], strict=True)]
    other = np.concatenate(others) + first[number][:, None]
    better = _folded(number, position[vertex[other]], len(bad)) < BETTER * folded[bad]
    result = corner.copy()
    result[rows] = np.where(better[number][:, None], other, corner[rows])
    return result


def _other(polygon: np.ndarray) -> np.ndarray:
    """Corners [N - 2, 3] of triangles of a polygon [N, 3] that its fan leaves."""
    if len(polygon) == 4:
        return OTHER_DIAGONAL
    found = ears(polygon)
    return fans(np.array([len(polygon)]))[1] if found is None else found


def _folded(face: np.ndarray, at: np.ndarray, polygons: int) -> np.ndarray:
    """How much of triangles [T, 3, 3] is wound against their polygons, by whose areas: [F].

    Triangles of a polygon that does not cross itself cover it once, and nothing else, if none is.
    """
    turn = np.cross(at[:, 1] - at[:, 0], at[:, 2] - at[:, 0])
    normal = np.stack([np.bincount(face, turn[:, k], polygons) for k in range(3)], 1)  # Newell's
    against = np.maximum(-(turn * normal[face]).sum(1), 0)
    folded: np.ndarray = np.bincount(face, against, polygons) / (normal**2).sum(1)
    return folded
