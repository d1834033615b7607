"""Values at corners, as texture coordinates are, on a subdivision surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from purelight_mitsuba.subdivision.cage import Cage, Index, Real

LINEAR, SMOOTH = "all", "vertex"


def split(cage: Cage, values: Real, rule: str) -> tuple[Cage, Real]:
    """A cage of the values themselves, apart at seams, and its values.

    Arguments:
        cage: Of the surface.
        values: [C, D] at its corners.
        rule: `faceVaryingLinearInterpolation` of UsdGeom, other than `all`.
    """
    rows = np.column_stack([cage.vertex, values])
    distinct, own = np.unique(rows, axis=0, return_inverse=True)
    own, vertex = own.ravel(), distinct[:, 0].astype(np.int64)
    crease = np.stack([own, own[cage.following]], 1)
    sharpness = cage.edge_sharpness[cage.edge]
    inherited = cage.vertex_sharpness[vertex]
    apart = Cage(cage.counts, own, len(distinct), crease, sharpness, inherited)
    sharp = np.where(_sharp(cage, apart, vertex, rule), np.inf, inherited)
    return replace(apart, corner_sharpness=sharp), distinct[:, 1:]


def _sharp(cage: Cage, apart: Cage, vertex: Index, rule: str) -> NDArray[np.bool_]:
    """Which of the values stay as they are: [apart.size].

    Arguments:
        vertex: [apart.size] of the surface, to which each value belongs.
    """
    if rule == "none":
        return np.zeros(apart.size, bool)
    if rule == "boundaries":
        return apart.boundary
    alone = np.bincount(apart.vertex, minlength=apart.size) == 1
    number = np.bincount(vertex)[vertex]
    sharp = alone.copy()
    if rule in ("cornersPlus1", "cornersPlus2"):
        sharp |= number > 2
    if rule == "cornersPlus2":
        concave = (number == 2) & (np.bincount(vertex, alone)[vertex] > 0)
        seam_ends = (number == 1) & apart.boundary & ~cage.boundary[vertex]
        sharp |= concave | seam_ends
    return sharp
