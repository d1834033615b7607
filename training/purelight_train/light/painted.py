"""Meshes that shine in colours of their own vertices or faces (Mitsuba's `mesh_attribute`).

Their radiance is known where a ray meets a face, not where `sample_position` draws a point.
"""

from __future__ import annotations

import re

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError

PAINT = re.compile(r'MeshAttribute\[\s*name = "(.*)"')  # in what Mitsuba says of an emitter


def painted(scene: mi.Scene) -> dict[int, mi.DiscreteDistribution]:
    """By the number of an emitter, the areas of the faces of its mesh, if that is painted.

    Raises:
        PureLightError: there are no such colours, and Mitsuba would take them for black.
    """
    found = {}
    for number, emitter in enumerate(scene.emitters()):
        if name := PAINT.search(str(emitter)):
            shape = emitter.get_shape()
            if shape is None or not _has_colors(shape, name[1]):
                named = emitter.id() if shape is None else shape.id()
                raise PureLightError(
                    f"emitter '{named}' shines in '{name[1]}', which it does not have; give its "
                    "mesh an attribute of that name with one number or three"
                )
            if "faces" in mi.traverse(shape):
                found[number] = _face_areas(shape)
    return found


def _has_colors(shape: mi.Shape, name: str) -> bool:
    """Whether a shape has an attribute of one number or three, or a picture in place of one."""
    parameters = mi.traverse(shape)
    if name not in parameters:
        return bool(dr.all(shape.has_attribute(name)))
    count = shape.vertex_count() if name.startswith("vertex_") else shape.face_count()
    return len(parameters[name]) in (count, 3 * count)


def _face_areas(mesh: mi.Mesh) -> mi.DiscreteDistribution:
    """Of the faces of a mesh, twice their areas, by which they are drawn."""
    parameters = mi.traverse(mesh)
    vertices = np.array(parameters["vertex_positions"], np.float64).reshape(-1, 3)
    a, b, c = vertices[np.array(parameters["faces"]).reshape(-1, 3).T]
    twice = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return mi.DiscreteDistribution(mi.Float(twice.astype(np.float32)))


def on_a_face(
    shape: mi.ShapePtr, areas: mi.DiscreteDistribution, sample: mi.Point2f, active: mi.Bool
) -> mi.SurfaceInteraction3f:
    """An even point of a mesh, with its face, which `sample_position` does not tell."""
    hit = dr.zeros(mi.PreliminaryIntersection3f)  # of a ray that ends there
    hit.prim_index, rest = areas.sample_reuse(sample.y, active)
    hit.prim_uv = mi.warp.square_to_uniform_triangle(mi.Point2f(sample.x, rest))
    hit.shape, hit.valid, hit.t = shape, active, mi.Float(0)
    si = hit.compute_surface_interaction(dr.zeros(mi.Ray3f), mi.RayFlags.All, active)
    si.sh_frame = mi.Frame3f(si.n)
    return si
