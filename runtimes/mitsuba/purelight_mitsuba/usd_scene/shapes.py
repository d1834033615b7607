"""Meshes and solids of a stage as triangles, by the material that each part is bound to."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from purelight_format.usd.walk import FURTHEST
from purelight_mitsuba.usd_scene.corners import Corners
from purelight_mitsuba.usd_scene.polygons import polygons
from purelight_mitsuba.usd_scene.solids import SOLIDS, solid
from purelight_mitsuba.usd_scene.subdivided import subdivided
from purelight_mitsuba.usd_scene.values import Values

LARGEST_UV = 1e6  # From which on float32 tells pixels no more apart
KINDS = ("Mesh", *SOLIDS)
Note = Callable[[Any, str], None]


class Bindings(Protocol):
    """What is asked about the materials of a shape, as `materials.Materials` tells it."""

    def uv_name(self, prim: Any) -> str:
        """The primvar with the texture coordinates of its material."""

    def subsets(self, prim: Any) -> Iterator[tuple[Any, np.ndarray]]:
        """Its parts with materials of their own: the subset, and its faces."""


def shapes(
    prim: Any, values: Values, materials: Bindings, note: Note, copies: int = 1
) -> Iterator[tuple[Any, Corners]]:
    """A prim of `KINDS` as triangles in the frame that `values` leads to.

    Arguments:
        copies: How often the scene has it.

    Returns:
        For each part, the prim or subset that its material is bound to, and its triangles.
    """
    with np.errstate(all="ignore"):
        own = _mesh(prim, values, materials, note, copies)
    if own is None:
        return
    yield from _parts(prim, _finite(prim, own, note).under(values.to_world(prim)), materials)


def _finite(prim: Any, corners: Corners, note: Note) -> Corners:
    """What of the triangles, their normals and their coordinates can be drawn."""
    with np.errstate(all="ignore"):
        there = (np.abs(corners.position) < FURTHEST).all((1, 2))
    if not there.all():
        note(prim, f"{np.count_nonzero(~there)} triangles are not finite and were left out")
    corners = corners.take(there)
    if corners.normal is not None and not np.isfinite(corners.normal).all():
        note(prim, "normals are not finite; rendered without them")
        corners = replace(corners, normal=None)
    if corners.uv is not None and not (kept := np.abs(corners.uv) < LARGEST_UV).all():
        note(prim, "texture coordinates beyond a million were taken as 0")
        corners = replace(corners, uv=np.where(kept, corners.uv, 0))
    return corners


def _mesh(
    prim: Any, values: Values, materials: Bindings, note: Note, copies: int
) -> Corners | None:
    """The triangles in the prim's own frame."""
    if str(prim.GetTypeName()) in SOLIDS:
        found = solid(prim, values)
        if found is None:
            note(prim, "the solid has no size that can be drawn and was left out")
        return found
    mesh = polygons(prim, values, materials.uv_name(prim))
    if mesh is None:
        note(prim, "the mesh has no valid faces and was left out")
        return None
    inward = str(values.get(prim, "orientation", "rightHanded")) == "leftHanded"
    surface, holes = subdivided(prim, mesh, values, note, copies)
    triangles = surface.triangles(holes)
    if surface is not mesh and triangles.normal is not None and inward:
        triangles = replace(triangles, normal=-triangles.normal)  # They follow the winding.
    return triangles.flipped() if inward else triangles


def _parts(prim: Any, corners: Corners, materials: Bindings) -> Iterator[tuple[Any, Corners]]:
    """The triangles by material."""
    rest = np.ones(len(corners.face), bool)
    subsets = materials.subsets(prim) if str(prim.GetTypeName()) == "Mesh" else ()
    for subset, faces in subsets:
        part = np.isin(corners.face, faces) & rest
        if part.any():
            yield subset, corners.take(part)
        rest &= ~part
    if rest.any():
        yield prim, corners.take(rest)
