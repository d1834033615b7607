"""Whether an exit surface is closed and convex: then a ray enters it at most once."""

from __future__ import annotations

import numpy as np

WITHIN = 1e-6  # Of the size: what rounding may lift a corner above a plane.
WHOLE = 4 * np.pi
ROUNDING = 1e-3  # Of the solid angle.


def outward(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """The triangles of a closed convex surface with their fronts outside; None for any other.

    Such a surface is known by its parts: each edge has two triangles that run along it in opposite
    directions, no corner of one lies above the other, and seen from within they cover the
    whole sphere once.

    Arguments:
        positions: [V, 3], no two of them equal.
        triangles: [T, 3].
    """
    corners = positions[triangles].astype(np.float64)
    centre = corners.mean((0, 1))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = (normal * (corners.mean(1) - centre)).sum(1) < 0
    turned = np.where(inward[:, None], triangles[:, ::-1], triangles)
    pairs = _pairs(turned)
    if pairs is None or not _bulges(positions.astype(np.float64), turned, *pairs):
        return None
    covered = _solid_angles(positions[turned] - centre).sum()
    return turned if abs(covered - WHOLE) < ROUNDING * WHOLE else None


def _pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Both triangles of every edge, [E] and [E]; None if an edge has not two that oppose."""
    count = int(triangles.max()) + 1
    begin = triangles.T.ravel().astype(np.int64)
    end = np.roll(triangles, -1, 1).T.ravel().astype(np.int64)
    owner = np.tile(np.arange(len(triangles)), 3)
    there, back = begin * count + end, end * count + begin
    order, other = np.argsort(there), np.argsort(back)
    if len(np.unique(there)) != len(there) or (there[order] != back[other]).any():
        return None
    return owner[order], owner[other]


def _bulges(
    positions: np.ndarray, triangles: np.ndarray, first: np.ndarray, second: np.ndarray
) -> bool:
    """Whether no corner of the second triangles lies before the planes of the first."""
    a, b, c = (positions[triangles[first, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    above = ((positions[triangles[second]] - a[:, None]) * normal[:, None]).sum(2)
    size = np.ptp(positions, 0).max()
    return bool((above <= WITHIN * size * np.maximum(length, 1e-300)).all())


def _solid_angles(corners: np.ndarray) -> np.ndarray:
    """Signed solid angles of triangles seen from the origin (van Oosterom and Strackee): [T]."""
    a, b, c = np.moveaxis(corners.astype(np.float64), 1, 0)
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    above = (a * np.cross(b, c)).sum(1)
    below = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return np.asarray(2 * np.arctan2(above, below))
