"""Spheres, cubes, cylinders, cones, capsules and planes of a stage as fine triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
import trimesh

from purelight_format.usd.walk import FURTHEST
from purelight_mitsuba.usd_scene.corners import Corners
from purelight_mitsuba.usd_scene.values import Values

SIZES = {
    "Sphere": ("radius",), "Cube": ("size",), "Cylinder": ("radius", "height"),
    "Cone": ("radius", "height"), "Capsule": ("radius", "height"), "Plane": ("width", "length"),
}  # fmt: skip
SOLIDS = tuple(SIZES)
SMALLEST = 1e-12
SMOOTH = ("Sphere", "Capsule")
TURN = {"X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}


def solid(prim: Any, values: Values) -> Corners | None:
    """A solid in its own frame, by the meaning of its USD attributes; None if it has no size."""
    kind = str(prim.GetTypeName())
    sizes = {name: values.number(prim, name, 1.0) for name in SIZES[kind]}
    if sizes.get("height") == 0:
        del sizes["height"]  # A disk, or a sphere
    if not all(SMALLEST < abs(size) < FURTHEST for size in sizes.values()):
        return None
    shape = _shape(prim, values)
    if kind not in ("Sphere", "Cube"):
        matrix = np.eye(4)
        matrix[:3, :3] = TURN.get(str(values.get(prim, "axis", "Z")), np.eye(3))
        shape.apply_transform(matrix)
    smooth = kind in SMOOTH
    normal = np.asarray(shape.vertex_normals)[shape.faces] if smooth else None
    position = np.asarray(shape.vertices, np.float64)[shape.faces]
    return Corners(position, np.arange(len(shape.faces)), normal)


def _shape(prim: Any, values: Values) -> trimesh.Trimesh:
    """A solid along the Z axis."""
    kind, radius = str(prim.GetTypeName()), values.number(prim, "radius", 1.0)
    height = values.number(prim, "height", 1.0 if kind == "Capsule" else 2.0)
    if kind == "Sphere":
        return trimesh.creation.icosphere(subdivisions=5, radius=radius)
    if kind == "Cube":
        return trimesh.creation.box(extents=[values.number(prim, "size", 2.0)] * 3)
    if kind == "Plane":
        x, y = values.number(prim, "width", 2.0) / 2, values.number(prim, "length", 2.0) / 2
        return trimesh.Trimesh([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]],
                               [[0, 1, 2], [0, 2, 3]], process=False)  # fmt: skip
    if kind == "Cylinder":
        return trimesh.creation.cylinder(radius=radius, height=height, sections=128)
    if kind == "Cone":
        shape = trimesh.creation.cone(radius=radius, height=height, sections=128)
        shape.apply_translation([0, 0, -height / 2])
        return shape
    shape = trimesh.creation.capsule(height=height, radius=radius, count=[64, 64])
    shape.apply_translation(-shape.bounds.mean(0))
    return shape
