"""Whether a mesh is a body, and which of its surfaces face the wrong way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from purelight_import.model.mesh import Mesh

SIDES = [[0, 1], [1, 2], [2, 0]]  # of a triangle, by its corners


@dataclass(frozen=True)
class Hull:
    """What is known of a mesh's connected surfaces.

    Arguments:
        surface: [T] number of the surface that each triangle belongs to.
        closed: [S] whether every edge of a surface joins two triangles of one orientation.
        volume: [S] signed volume within each, negative where it is inside out.
    """

    surface: NDArray[np.int64]
    closed: NDArray[np.bool_]
    volume: NDArray[np.float64]

    @property
    def all_closed(self) -> bool:
        return bool(self.closed.all())


def hull(mesh: Mesh) -> Hull:
    """Looks at a mesh's surfaces; corners at one place are one.

    Triangles whose corners fall together are not counted.
    """
    corners = mesh.welded()
    count = int(corners.max()) + 1
    number, surface = _connected(corners)
    proper = (np.sort(corners, 1)[:, :-1] != np.sort(corners, 1)[:, 1:]).all(1)
    ends = corners[proper][:, SIDES].reshape(-1, 2)
    unpaired = _unpaired(ends, count)
    closed = np.ones(number, bool)
    closed[np.repeat(surface[proper], 3)[unpaired]] = False
    a, b, c = np.moveaxis(mesh.corners - mesh.positions.mean(0), 1, 0)
    sixth = np.einsum("td,td->t", a, np.cross(b, c)) / 6
    volume = np.bincount(surface, sixth, number).astype(np.float64)
    return Hull(surface, closed, volume)


def surfaces(mesh: Mesh) -> tuple[int, NDArray[np.int64]]:
    """How many surfaces do not touch, and which one each triangle belongs to: [T]."""
    return _connected(mesh.welded())


def _connected(corners: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """The same of triangles by places, `Mesh.welded`."""
    sides = corners[:, SIDES].reshape(-1, 2)
    size = int(corners.max()) + 1
    graph = coo_matrix((np.ones(len(sides)), tuple(sides.T)), (size, size))
    number, label = connected_components(graph, directed=False)
    return int(number), label[corners[:, 0]].astype(np.int64)


def _unpaired(ends: NDArray[np.int64], count: int) -> NDArray[np.bool_]:
    """Which directed edges [E, 2] are not met by as many in the other direction: [E]."""
    forward, backward = ends[:, 0] * count + ends[:, 1], ends[:, 1] * count + ends[:, 0]
    keys, where = np.unique(np.concatenate((forward, backward)), return_inverse=True)
    there = np.bincount(where[: len(ends)], minlength=len(keys))
    back = np.bincount(where[len(ends) :], minlength=len(keys))
    odd: NDArray[np.bool_] = (there != back)[where[: len(ends)]]
    return odd
