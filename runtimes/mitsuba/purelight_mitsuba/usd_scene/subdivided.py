"""Subdivision surfaces of a stage, refined."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from purelight_mitsuba.subdivision import Cage, refine
from purelight_mitsuba.subdivision.cage import INFINITE
from purelight_mitsuba.subdivision.refine import level
from purelight_mitsuba.usd_scene.polygons import Polygons
from purelight_mitsuba.usd_scene.values import Values

SCHEMES = ("catmullClark", "loop", "bilinear")
MOST_FACES = 250_000  # Of a cage; finer ones are shown as they are.
EMPTY = np.zeros((0, 2), np.int64)


def subdivided(
    prim: Any, cage: Polygons, values: Values, note: Callable[[Any, str], None], copies: int
) -> tuple[Polygons, np.ndarray]:
    """The surface of a mesh by its `subdivisionScheme`, and its faces that are not shown.

    Arguments:
        cage: The mesh itself.
        note: Is told where it is shown as its control mesh.
        copies: How often the scene has it.
    """
    holes = np.asarray(values.get(prim, "holeIndices", []), np.int64)
    scheme = str(values.get(prim, "subdivisionScheme", "catmullClark"))
    if scheme == "none":
        return cage, holes
    cage = _proper(cage)
    triangular = bool((cage.counts == 3).all())
    if scheme not in SCHEMES or not len(cage.counts) or (scheme == "loop" and not triangular):
        note(prim, f"{scheme} subdivision does not fit its faces; rendered as its control mesh")
        return cage, holes
    if len(cage.counts) > MOST_FACES:
        note(prim, f"more than {MOST_FACES:,} faces; rendered as its control mesh")
        return cage, holes
    refined = _refined(prim, cage, values, note, scheme, copies)
    return refined, np.concatenate([holes, _at_boundary(prim, cage, values)])


def _proper(mesh: Polygons) -> Polygons:
    """The polygons with an inside."""
    good = mesh.counts >= 3
    if good.all():
        return mesh
    corner = np.repeat(good, mesh.counts)
    normal, uv = (None if a is None else a[corner] for a in (mesh.normal, mesh.uv))
    return Polygons(
        mesh.counts[good], mesh.vertex[corner], mesh.position, mesh.parent[good], normal, uv,
        mesh.uv_interpolation,
    )  # fmt: skip


def _refined(
    prim: Any,
    mesh: Polygons,
    values: Values,
    note: Callable[[Any, str], None],
    scheme: str,
    copies: int,
) -> Polygons:
    rule = str(values.get(prim, "faceVaryingLinearInterpolation", "cornersPlus1"))
    how = mesh.uv_interpolation
    uv = None if mesh.uv is None else mesh.uv.astype(np.float64)
    fine = refine(
        _cage(prim, mesh, values, note), mesh.position, level(len(mesh.counts), copies),
        scheme=scheme,
        smooth_triangles=str(values.get(prim, "triangleSubdivisionRule", "")) == "smooth",
        uv=uv,
        uv_rule={"vertex": "vertex", "faceVarying": rule}.get(how, "all"),
    )  # fmt: skip
    parent = mesh.parent[fine.parent]
    return Polygons(fine.counts, fine.vertex, fine.position, parent, fine.normal, fine.uv, how)


def _cage(prim: Any, mesh: Polygons, values: Values, note: Callable[[Any, str], None]) -> Cage:
    """The mesh with the sharpness that the prim gives its edges and vertices."""
    size = len(mesh.position)
    crease, sharpness = _creases(prim, values, size, note)
    corner = np.zeros(size)
    index = np.asarray(values.get(prim, "cornerIndices", []), np.int64)
    sharp = np.asarray(values.get(prim, "cornerSharpnesses", []), np.float64)
    if len(index) == len(sharp) and (not len(index) or 0 <= index.min() <= index.max() < size):
        corner[index] = sharp
    else:
        note(prim, "its corners do not fit the mesh and were ignored")
    if str(values.get(prim, "interpolateBoundary", "edgeAndCorner")) == "edgeAndCorner":
        corner[np.bincount(mesh.vertex, minlength=size) == 1] = INFINITE
    return Cage(mesh.counts, mesh.vertex, size, crease, sharpness, corner)


def _creases(
    prim: Any, values: Values, size: int, note: Callable[[Any, str], None]
) -> tuple[np.ndarray, np.ndarray]:
    """Edges [N, 2] by their vertices, and their sharpness [N]."""
    index, lengths = (
        np.asarray(values.get(prim, name, []), np.int64)
        for name in ("creaseIndices", "creaseLengths")
    )
    sharpness = np.asarray(values.get(prim, "creaseSharpnesses", []), np.float64)
    if not len(index) and not len(lengths):
        return EMPTY, np.zeros(0)
    edges = np.maximum(lengths - 1, 0)
    if len(sharpness) == len(lengths):
        sharpness = np.repeat(sharpness, edges)
    fits = (lengths > 1).all() and lengths.sum() == len(index) and len(sharpness) == edges.sum()
    if not fits or not 0 <= index.min() <= index.max() < size:
        note(prim, "its creases do not fit the mesh and were ignored")
        return EMPTY, np.zeros(0)
    first = np.delete(np.arange(len(index)), np.cumsum(lengths) - 1)
    return np.stack([index[first], index[first + 1]], 1), sharpness


def _at_boundary(prim: Any, mesh: Polygons, values: Values) -> np.ndarray:
    """Faces that are not shown because the boundary is not interpolated."""
    if str(values.get(prim, "interpolateBoundary", "edgeAndCorner")) != "none":
        return np.zeros(0, np.int64)
    plain = Cage(mesh.counts, mesh.vertex, len(mesh.position), EMPTY, np.zeros(0), np.zeros(0))
    return mesh.parent[np.unique(plain.face[plain.boundary[mesh.vertex]])]
