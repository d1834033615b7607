"""Loop surfaces of triangles: a level of refinement, and the surface itself."""

from __future__ import annotations

import numpy as np

from purelight_mitsuba.subdivision import rules
from purelight_mitsuba.subdivision.cage import Cage, Real, total


def step(cage: Cage, values: Real, *, linear: bool = False) -> tuple[Cage, Real]:
    """A level: each triangle becomes four, those of its corners before that of its middle.

    Arguments:
        values: [size, D] at the vertices.
        linear: Whether the triangles are only cut, not smoothed.
    """
    vertex, edge = values, values[cage.edges].mean(1)
    if not linear:
        edge = rules.new_edges(cage, values, _edges(cage, values))
        vertex = rules.new_vertices(cage, values, _vertices(cage, values))
    corner = cage.vertex.reshape(-1, 3)
    on_edge = cage.size + cage.edge.reshape(-1, 3)
    before = on_edge[:, [2, 0, 1]]
    corners = np.stack([corner, on_edge, before], 2)
    faces = np.concatenate([corners, on_edge[:, None]], 1).reshape(-1, 3)
    finer = rules.finer(cage, np.full(len(faces), 3), faces.ravel(), len(edge))
    return finer, np.concatenate([vertex, edge])


def _edges(cage: Cage, values: Real) -> Real:
    opposite = total(cage.edge, values[cage.vertex[cage.previous]], len(cage.edges))
    return (3 * values[cage.edges].sum(1) + opposite) / 8


def _share(cage: Cage) -> tuple[Real, Real]:
    """Number of neighbours, and the weight of each (Loop 1987): [size, 1] each."""
    n = np.maximum(np.bincount(cage.edges.ravel(), minlength=cage.size), 1)[:, None]
    return n, (0.625 - (0.375 + 0.25 * np.cos(2 * np.pi / n)) ** 2) / n


def _vertices(cage: Cage, values: Real) -> Real:
    n, share = _share(cage)
    around = rules.neighbours(cage, values, np.ones(len(cage.edges), bool))
    return (1 - n * share) * values + share * around


def limit(cage: Cage, values: Real) -> Real:
    """The surface at the vertices: [size, D]."""
    n, share = _share(cage)
    weight = 1 / (n + 3 / (8 * share))
    around = rules.neighbours(cage, values, np.ones(len(cage.edges), bool))
    return rules.limit(cage, values, (1 - n * weight) * values + weight * around)
