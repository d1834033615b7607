"""Normals that are interpolated over the facets of smooth finishes (spec/finishes.md)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from purelight_format.members.finishes import Finish
from purelight_format.members.surface import Surface

CREASE = 0.5  # Cosine between facets that meet in an edge.
MOST = 64  # Triangles at a point; where more meet, as at the tip of a cone, it stays flat.
Array = NDArray[np.float64]


def corner_normals(surface: Surface, finishes: Sequence[Finish]) -> Array:
    """Unit normals in the corners of the triangles, on their front: [T, 3, 3].

    Those of flat finishes are the triangle's own; +Z where it has no area.
    """
    corners = surface.positions.astype(np.float64)[surface.triangles]
    a, b, c = np.moveaxis(corners, 1, 0)
    cross = np.cross(b - a, c - a)
    own = _unit(cross)
    result = np.repeat(own[:, None], 3, 1)
    if surface.finish is None or not len(finishes):
        return result
    table = np.zeros(256, bool)
    table[: len(finishes)] = [finish.smooth for finish in finishes]
    smooth = np.flatnonzero(table[surface.finish].any(1))
    if len(smooth):
        result[smooth] = _interpolated(corners[smooth], cross[smooth], surface.finish[smooth])
    return result


def _interpolated(corners: Array, cross: Array, finish: NDArray[np.uint8]) -> Array:
    """Means over the triangles that meet in a point and have the same finishes: [S, 3, 3]."""
    _, point = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    material = np.repeat(finish.astype(np.int64) @ [256, 1], 3)
    key = point.reshape(-1) * 65_536 + material
    order = np.argsort(key, kind="stable")
    sorted_key, normal = key[order], np.repeat(cross, 3, 0)[order]
    unit, total = _unit(normal), normal.copy()
    _, count = np.unique(sorted_key, return_counts=True)
    for step in range(1, min(int(count.max()), MOST)):
        near = np.flatnonzero(sorted_key[step:] == sorted_key[:-step])
        far = near + step
        alike = (unit[near] * unit[far]).sum(1) > CREASE
        near, far = near[alike], far[alike]
        np.add.at(total, near, normal[far])
        np.add.at(total, far, normal[near])
    crowded = np.repeat(count > MOST, count)
    total[crowded] = normal[crowded]
    result = np.empty_like(total)
    result[order] = _unit(total)
    return result.reshape(-1, 3, 3)


def _unit(vectors: Array) -> Array:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
