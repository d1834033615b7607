"""What Catmull-Clark and Loop surfaces have in common: creases, corners and their fading.

The rules are those of OpenSubdiv (uniform semi-sharp creases; DeRose, Kass and Truong 1998).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from purelight_mitsuba.subdivision.cage import Cage, Index, Real, total

SMOOTH, CREASE, CORNER = 0, 1, 2


def softer(sharpness: Real) -> Real:
    """Sharpness after a level."""
    return np.maximum(sharpness - 1, 0)


def vertex_rule(cage: Cage, edge: Real, vertex: Real) -> Index:
    """SMOOTH, CREASE or CORNER for each vertex, from the sharpness of edges and vertices."""
    sharp = np.bincount(cage.edges[edge > 0].ravel(), minlength=cage.size)
    rule = np.where(sharp == 2, CREASE, np.where(sharp > 2, CORNER, SMOOTH))
    return np.where(vertex > 0, CORNER, rule)


def neighbours(cage: Cage, values: Real, chosen: NDArray[np.bool_]) -> Real:
    """Sums of the values at the other ends of chosen edges [E]: [size, D]."""
    a, b = cage.edges[chosen].T
    return total(np.concatenate([a, b]), values[np.concatenate([b, a])], cage.size)


def new_vertices(cage: Cage, values: Real, smooth: Real) -> Real:
    """Values at the old vertices after a level: [size, D].

    Arguments:
        smooth: What they are where nothing is sharp.
    """
    edge, vertex = cage.edge_sharpness, cage.vertex_sharpness
    before = _by_rule(cage, values, smooth, edge, vertex)
    after = _by_rule(cage, values, smooth, softer(edge), softer(vertex))
    share = _share(cage)[:, None]
    return share * before + (1 - share) * after


def _by_rule(cage: Cage, values: Real, smooth: Real, edge: Real, vertex: Real) -> Real:
    rule = vertex_rule(cage, edge, vertex)[:, None]
    crease = (6 * values + neighbours(cage, values, edge > 0)) / 8
    return np.where(rule == CORNER, values, np.where(rule == CREASE, crease, smooth))


def _share(cage: Cage) -> Real:
    """How much of a vertex follows the rule before a level, where sharpness ends within it."""
    edge, vertex = cage.edge_sharpness, cage.vertex_sharpness
    ending = (edge > 0) & (edge <= 1)
    ends = cage.edges[ending].ravel()
    last = (vertex > 0) & (vertex <= 1)
    number = np.bincount(ends, minlength=cage.size) + last
    amount = np.bincount(ends, np.repeat(edge[ending], 2), cage.size) + np.where(last, vertex, 0)
    return amount / np.maximum(number, 1)


def new_edges(cage: Cage, values: Real, smooth: Real) -> Real:
    """Values at the new vertices on edges: [E, D].

    Arguments:
        smooth: What they are where nothing is sharp.
    """
    share = np.minimum(cage.edge_sharpness, 1)[:, None]
    return share * values[cage.edges].mean(1) + (1 - share) * smooth


def finer(cage: Cage, counts: Index, vertex: Index, added: int) -> Cage:
    """A cage after a level, whose vertices are the old ones, those of the edges, and more.

    Arguments:
        counts, vertex: Of its polygons.
        added: Number of vertices besides those of the old vertices.
    """
    sharp = np.flatnonzero(softer(cage.edge_sharpness) > 0)
    middle = cage.size + sharp
    halves = [np.stack([end, middle], 1) for end in cage.edges[sharp].T]
    sharpness = softer(cage.edge_sharpness)[sharp]
    return Cage(
        counts, vertex, cage.size + added,
        np.concatenate(halves), np.concatenate([sharpness, sharpness]),
        np.concatenate([softer(cage.vertex_sharpness), np.zeros(added)]),
    )  # fmt: skip


def limit(cage: Cage, values: Real, smooth: Real) -> Real:
    """Values of the surface itself at the vertices of a level: [size, D].

    Arguments:
        smooth: What they are where nothing is sharp.
    """
    edge = cage.edge_sharpness
    rule = vertex_rule(cage, edge, cage.vertex_sharpness)[:, None]
    crease = (4 * values + neighbours(cage, values, edge > 0)) / 6
    return np.where(rule == CORNER, values, np.where(rule == CREASE, crease, smooth))
