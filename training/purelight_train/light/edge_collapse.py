"""Edges of a triangle mesh that collapse onto one of their ends, as long as little is moved.

A vertex goes to a neighbour (Schroeder, Zarge and Lorensen 1992), many of them at a time. Points of
the mesh as it was stay within a tolerance of what it becomes. Vertices on borders go along them;
what is left are corners of the mesh as it was.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix

from purelight_train.light.edge_ways import Mesh, Ways, beside_line, weighed
from purelight_train.light.edge_witnesses import Witnesses, around

Float = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
FEWEST = 2e-3  # of the triangles: rounds that take fewer away are not worth their time
FINEST = 1e-3  # of the tolerance: what is less is as good as none


@dataclass(frozen=True)
class _Edges:
    """The edges of a mesh.

    Arguments:
        ends: [E, 2], the lower vertex first.
        faces: [E] how many triangles each has.
        border: [E] whether it is kept in its place.
        beside: [V, V] which vertices are neighbours.
    """

    ends: Index
    faces: Index
    border: Mask
    beside: csr_matrix

    @staticmethod
    def of(mesh: Mesh) -> _Edges:
        count = len(mesh.positions)
        pair = np.sort(mesh.corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
        key, first, own, faces = np.unique(
            pair @ [count, 1], return_index=True, return_inverse=True, return_counts=True
        )
        label = np.repeat(mesh.label, 3)
        other = np.bincount(own.ravel(), label != label[first][own.ravel()], len(key)) > 0
        ends = np.stack(np.divmod(key, count), 1)
        both = np.concatenate([ends, ends[:, ::-1]])
        ones = np.ones(len(both), np.int32)
        beside = coo_matrix((ones, tuple(both.T)), (count, count)).tocsr()
        return _Edges(ends, faces, (faces != 2) | other, beside)


def collapsed(mesh: Mesh, cosine: float) -> Mesh:
    """A mesh with fewer triangles.

    Arguments:
        cosine: of the most that normals are turned.
    """
    rng = np.random.default_rng(0)
    witnesses = Witnesses.of(mesh)
    open_ = np.ones(len(mesh.positions), bool)  # What is around others stayed, and has no way.
    while True:
        edges = _Edges.of(mesh)
        ways = _best(mesh, edges, cosine, open_)
        open_[:] = False
        open_[ways.start] = True
        ways = _independent(ways, edges, rng)
        witnesses, good = witnesses.after(mesh, ways)
        open_[ways.start[~good]] = False
        ways = ways.take(good)
        fewer = _gone(mesh, ways)
        if len(fewer.corners) > (1 - FEWEST) * len(mesh.corners):
            return fewer
        open_[edges.beside[ways.start].indices] = True
        mesh = fewer


def _best(mesh: Mesh, edges: _Edges, cosine: float, asked: Mask) -> Ways:
    """The way of each vertex that is asked for, [V], of those allowed the one that moves least."""
    count = len(mesh.positions)
    borders = np.bincount(edges.ends[edges.border].ravel(), minlength=count)
    # On a border, the neighbour on the other side of it
    ahead = np.zeros(count, np.int64)
    for near, far in (edges.ends.T, edges.ends.T[::-1]):
        np.add.at(ahead, near[edges.border], far[edges.border])
    a, b = edges.ends.T
    common = np.asarray(edges.beside[a].multiply(edges.beside[b]).sum(1)).ravel()
    simple = common == edges.faces  # Else the mesh would be pinched (the link condition).
    found = []
    for start, end in ((a, b), (b, a)):
        free = borders[start] == 0
        along = (borders[start] == 2) & edges.border
        index = np.flatnonzero(simple & (free | along) & asked[start])
        start, end = start[index], end[index]
        line = np.zeros(len(index))
        at = np.flatnonzero(borders[start] == 2)
        line[at] = beside_line(mesh.positions, start[at], end[at], ahead[start[at]] - end[at])
        found.append(weighed(mesh, Ways(start, end, line), cosine))
    ways = Ways(*(np.concatenate([getattr(w, n) for w in found]) for n in ("start", "end", "cost")))
    length = np.linalg.norm(mesh.positions[ways.start] - mesh.positions[ways.end], axis=1)
    scale = mesh.tolerance.max(initial=0)
    order = np.lexsort((length, np.maximum(ways.cost, FINEST * scale), ways.start))
    ways = ways.take(order)
    return ways.take(np.unique(ways.start, return_index=True)[1])


def _independent(ways: Ways, edges: _Edges, rng: np.random.Generator) -> Ways:
    """Ways that do not touch: no neighbours, and no two neighbours in common."""
    count = edges.beside.shape[0]
    scale = max(float(ways.cost.max(initial=0)), 1e-300)
    rank = np.full(count, np.inf)
    step = np.floor(np.log2(np.maximum(ways.cost / scale, FINEST)))
    rank[ways.start] = step + rng.random(len(step))
    least = np.full(count, np.inf)
    for near, far in (edges.ends.T, edges.ends.T[::-1]):
        np.minimum.at(least, near, rank[far])
    ways = ways.take(rank[ways.start] < least[ways.start])
    ring = edges.beside[ways.start]
    shared = (ring @ ring.T).tocoo()
    own, other = ways.start[shared.row], ways.start[shared.col]
    later = (shared.data >= 2) & (rank[own] > rank[other])
    kept = np.ones(len(ways.start), bool)
    kept[shared.row[later]] = False
    return ways.take(kept)


def _gone(mesh: Mesh, ways: Ways) -> Mesh:
    """The mesh after vertices went their ways; the least tolerance of those around counts."""
    target = np.arange(len(mesh.positions))
    target[ways.start] = ways.end
    tolerance, which = mesh.tolerance.copy(), around(mesh, ways)
    near = np.full(len(ways.start), np.inf)
    np.minimum.at(near, which[which >= 0], tolerance[which >= 0])
    tolerance[which >= 0] = near[which[which >= 0]]
    corners = target[mesh.corners]
    left = (corners != np.roll(corners, 1, 1)).all(1)
    return replace(mesh, corners=corners, tolerance=tolerance).take(left)
