"""Normals at the corners of polygons, smooth except across sharp edges."""

from __future__ import annotations

import numpy as np

from purelight_mitsuba.subdivision.cage import Cage, Index, Real, total


def normals(cage: Cage, position: Real) -> Real:
    """Unit normals at the corners: [C, 3].

    Arguments:
        cage: Whose edges of a sharpness of one or more part the normals on their two sides.
        position: [size, 3] of the vertices.
    """
    at = position[cage.vertex]
    middle = total(cage.face, at, len(cage.counts)) / cage.counts[:, None]
    from_middle = at - middle[cage.face]
    area = total(cage.face, np.cross(from_middle, from_middle[cage.following]), len(cage.counts))
    group = _groups(cage)
    summed = total(group, area[cage.face], max(len(cage.vertex), cage.size))[group]
    return summed / np.maximum(np.linalg.norm(summed, axis=1, keepdims=True), 1e-300)


def _groups(cage: Cage) -> Index:
    """Equal for the corners of a vertex that no sharp edge parts: [C]."""
    parting = cage.edge_sharpness >= 1
    if not (parting & (cage.edge_faces == 2)).any():
        return cage.vertex
    one, other = _across(cage, parting)
    group = np.arange(len(cage.vertex))
    while True:
        least = np.minimum(group[one], group[other])
        new = group.copy()
        np.minimum.at(new, one, least)
        np.minimum.at(new, other, least)
        if (new == group).all():
            return group
        group = new


def _across(cage: Cage, parting: np.ndarray) -> tuple[Index, Index]:
    """Pairs of corners of one vertex on the two sides of edges that part nothing."""
    order = np.argsort(cage.edge, kind="stable")
    order = order[((cage.edge_faces == 2) & ~parting)[cage.edge[order]]]
    a, b = order.reshape(-1, 2).T  # Two corners of each edge, from which it leaves.
    same = cage.vertex[a] == cage.vertex[b]  # Polygons of opposite windings.
    after_a, after_b = cage.following[a], cage.following[b]
    one = np.concatenate([a, after_a])
    other = np.concatenate([np.where(same, b, after_b), np.where(same, after_b, b)])
    return one, other
