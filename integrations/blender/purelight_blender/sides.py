"""From which side of each triangle light leaves: the one from which the lamp is left at once."""

from __future__ import annotations

import numpy as np
from mathutils import Vector
from mathutils.bvhtree import BVHTree

LIFT = 1e-4  # Of the size, above the triangle.


def open_sides(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The triangles turned so that their fronts are free, and which have a free back too.

    Only an aim depends on this, no light: rays along the normals of each triangle tell.

    Arguments:
        positions: [V, 3].
        triangles: [T, 3].

    Returns:
        [T, 3] and [T] whether either side, or neither, is free.
    """
    tree = BVHTree.FromPolygons(positions.tolist(), triangles.tolist(), all_triangles=True)
    corners = positions[triangles].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    centre, lift = corners.mean(1), LIFT * np.ptp(positions, 0).max()
    front, back = (_free(tree, centre + lift * side, side) for side in (normal, -normal))
    turned = np.where((back & ~front)[:, None], triangles[:, ::-1], triangles)
    return turned, front == back


def _free(tree: BVHTree, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    rays = zip(origins.tolist(), directions.tolist(), strict=True)
    return np.array([tree.ray_cast(Vector(o), Vector(d))[0] is None for o, d in rays])
