"""Catmull-Clark surfaces: a level of refinement, and the surface itself."""

from __future__ import annotations

import numpy as np

from purelight_mitsuba.subdivision import rules
from purelight_mitsuba.subdivision.cage import Cage, Real, total

TRIANGLE = 0.470  # Weight of a triangle's middle under the rule `smooth` of UsdGeom.


def step(
    cage: Cage, values: Real, *, linear: bool = False, smooth_triangles: bool = False
) -> tuple[Cage, Real]:
    """A level: each polygon of n corners becomes n quadrangles, in the order of its corners.

    Arguments:
        values: [size, D] at the vertices.
        linear: Whether the polygons are only cut, not smoothed.
        smooth_triangles: The rule `smooth` for triangles.
    """
    middle = total(cage.face, values[cage.vertex], len(cage.counts)) / cage.counts[:, None]
    vertex, edge = values, values[cage.edges].mean(1)
    if not linear:
        edge = rules.new_edges(cage, values, _edges(cage, values, middle, smooth_triangles))
        vertex = rules.new_vertices(cage, values, _vertices(cage, values, middle))
    on_edge = cage.size + cage.edge
    quads = np.stack(
        [cage.vertex, on_edge, cage.size + len(edge) + cage.face, on_edge[cage.previous]], 1
    )
    counts = np.full(len(quads), 4)
    finer = rules.finer(cage, counts, quads.ravel(), len(edge) + len(middle))
    return finer, np.concatenate([vertex, edge, middle])


def _edges(cage: Cage, values: Real, middle: Real, smooth_triangles: bool) -> Real:
    weight = np.where((cage.counts == 3) & smooth_triangles, TRIANGLE, 0.25)
    share = np.bincount(cage.edge, weight[cage.face], len(cage.edges)) / 2
    faces = total(cage.edge, middle[cage.face], len(cage.edges))
    ends = values[cage.edges].sum(1)
    return share[:, None] * faces + (0.5 - share)[:, None] * ends


def _vertices(cage: Cage, values: Real, middle: Real) -> Real:
    number = np.bincount(cage.vertex, minlength=cage.size)[:, None]
    n = np.maximum(number, 1)
    faces = total(cage.vertex, middle[cage.face], cage.size)
    around = rules.neighbours(cage, values, np.ones(len(cage.edges), bool))
    return np.where(number > 0, (n - 2) / n * values + (faces + around) / n**2, values)


def limit(cage: Cage, values: Real) -> Real:
    """The surface at the vertices of a cage of quadrangles: [size, D]."""
    n = np.maximum(np.bincount(cage.vertex, minlength=cage.size)[:, None], 1)
    around = rules.neighbours(cage, values, np.ones(len(cage.edges), bool))
    opposite = cage.vertex[cage.following[cage.following]]
    across = total(cage.vertex, values[opposite], cage.size)
    return rules.limit(cage, values, (n**2 * values + 4 * around + across) / (n * (n + 5)))
