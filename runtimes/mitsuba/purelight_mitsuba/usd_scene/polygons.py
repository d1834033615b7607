"""The polygons of a `UsdGeom.Mesh`, with values at their corners."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_mitsuba.usd_scene.corners import Corners, at_corners
from purelight_mitsuba.usd_scene.cutting import cut
from purelight_mitsuba.usd_scene.values import Values


@dataclass(frozen=True)
class Polygons:
    """Polygons in their prim's own frame.

    Arguments:
        counts: [F] corners of each.
        vertex: [C] the vertex of each corner.
        position: [V, 3] of the vertices.
        parent: [F] the face of the prim that each is, or is a part of.
        normal: [C, 3] unit normals, or None.
        uv: [C, 2], or None.
        uv_interpolation: As UsdGeom names it.
    """

    counts: np.ndarray
    vertex: np.ndarray
    position: np.ndarray
    parent: np.ndarray
    normal: np.ndarray | None = None
    uv: np.ndarray | None = None
    uv_interpolation: str = ""

    def triangles(self, holes: np.ndarray) -> Corners:
        """The polygons cut into triangles, without those whose parents are holes."""
        polygon, corner = cut(self.counts, self.vertex, self.position)
        keep = ~np.isin(self.parent[polygon], holes)
        polygon, corner = polygon[keep], corner[keep]
        normal, uv = (None if a is None else a[corner] for a in (self.normal, self.uv))
        return Corners(self.position[self.vertex[corner]], self.parent[polygon], normal, uv)


def polygons(prim: Any, values: Values, uv_name: str) -> Polygons | None:
    """Reads a mesh; None where its indices are not valid.

    Arguments:
        uv_name: The primvar that holds texture coordinates.
    """
    counts = np.asarray(values.get(prim, "faceVertexCounts", []), np.int64)
    vertex = np.asarray(values.get(prim, "faceVertexIndices", []), np.int64)
    position = np.asarray(values.get(prim, "points", []), np.float64).reshape(-1, 3)
    whole = len(counts) and counts.min() >= 0 and counts.sum() == len(vertex)
    if not whole or not len(vertex) or not 0 <= vertex.min() <= vertex.max() < len(position):
        return None
    face, corner = np.repeat(np.arange(len(counts)), counts), np.arange(len(vertex))
    normal = at_corners(_normals(prim, values), corner, vertex, face)
    found = values.primvar(prim, uv_name, 2)
    uv = at_corners(found, corner, vertex, face)
    rule = found[1] if found and uv is not None else ""
    return Polygons(counts, vertex, position, np.arange(len(counts)), normal, uv, rule)


def _normals(prim: Any, values: Values) -> tuple[np.ndarray, str] | None:
    """Authored normals, as a primvar or as the mesh's attribute."""
    from pxr import UsdGeom

    found = values.primvar(prim, "normals", 3)
    raw = np.asarray(values.get(prim, "normals", []), np.float32)
    if found is None and len(raw):
        found = raw.reshape(-1, 3), str(UsdGeom.Mesh(prim).GetNormalsInterpolation())
    return found
