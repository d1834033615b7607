"""A subdivision surface as polygons fine enough to render."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from purelight_mitsuba.subdivision import catmull_clark, loop
from purelight_mitsuba.subdivision.cage import Cage, Index, Real
from purelight_mitsuba.subdivision.face_varying import LINEAR, SMOOTH, split
from purelight_mitsuba.subdivision.normals import normals

Step = Callable[[Cage, Real], tuple[Cage, Real]]
FACES, LEVELS = 60_000, 5  # Refinement ends before a mesh has more, and at this level.


@dataclass(frozen=True)
class Refined:
    """Polygons on a subdivision surface.

    Arguments:
        counts: [F] corners of each.
        vertex: [C] the vertex of each corner.
        position: [V, 3] of the vertices.
        parent: [F] the polygon of the cage that each came from.
        normal: [C, 3] unit normals; None where the surface is not smooth by its scheme.
        uv: [C, 2], or None.
    """

    counts: Index
    vertex: Index
    position: Real
    parent: Index
    normal: Real | None
    uv: Real | None


def level(faces: int, copies: int = 1) -> int:
    """How often to refine a mesh of so many polygons, of which a scene has copies."""
    room = min(FACES, max(4 * faces, 32 * FACES // copies))
    return int(np.clip(np.floor(np.log(room / max(faces, 1)) / np.log(4)), 1, LEVELS))


def refine(
    cage: Cage,
    position: Real,
    levels: int,
    *,
    scheme: str = "catmullClark",
    smooth_triangles: bool = False,
    uv: Real | None = None,
    uv_rule: str = "cornersPlus1",
) -> Refined:
    """Refines a cage and moves its vertices onto the surface.

    Arguments:
        position: [V, 3] of the cage's vertices.
        levels: At least one.
        scheme: `catmullClark`, `loop` (triangles only) or `bilinear`.
        smooth_triangles: Whether Catmull-Clark treats triangles by the rule `smooth`.
        uv: [C, 2] at the corners.
        uv_rule: `faceVaryingLinearInterpolation`, or `vertex` to refine them as positions are.
    """
    module = loop if scheme == "loop" else catmull_clark
    more = {} if scheme == "loop" else {"smooth_triangles": smooth_triangles}
    linear = partial(module.step, linear=True)
    flat = scheme == "bilinear"
    smooth: Step = linear if flat else partial(module.step, **more)

    def refined(cage: Cage, values: Real, step: Step) -> tuple[Cage, Real]:
        for _ in range(levels):
            cage, values = step(cage, values)
        return cage, values if step is linear else module.limit(cage, values)

    fine, moved = refined(cage, position, smooth)
    if uv is not None:
        apart = _apart(cage, uv, uv_rule)
        finest, found = refined(*apart, linear if uv_rule == LINEAR else smooth)
        uv = found[finest.vertex]
    normal = None if flat else normals(fine, moved)
    parent = _parents(cage, levels, 4 if scheme == "loop" else None)
    return Refined(fine.counts, fine.vertex, moved, parent, normal, uv)


def _apart(cage: Cage, uv: Real, rule: str) -> tuple[Cage, Real]:
    """The cage on which values at corners are refined, and its values."""
    if rule != SMOOTH:
        return split(cage, uv, rule)
    values = np.zeros((cage.size, uv.shape[1]))
    values[cage.vertex] = uv
    return cage, values


def _parents(cage: Cage, levels: int, children: int | None) -> Index:
    """The polygon of the cage from which each polygon came.

    Arguments:
        children: Of a polygon in each level; as many as it has corners if None, and then four.
    """
    first = np.full(len(cage.counts), children) if children else cage.counts
    return np.repeat(np.arange(len(cage.counts)), first * 4 ** (levels - 1))
