"""Vertex normals that Mitsuba finds for meshes that state none, the same at every load."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

ROUNDING = 1e-4  # between normals that differ by the order of their sum alone


def settle(scene: mi.Scene) -> None:
    """Find the computed vertex normals of all meshes anew, by one thread.

    Mitsuba adds up the facets about a vertex in the order in which threads come to them, so a mesh
    of some thousand vertices differs in its last digits from load to load, and so does all light
    of the lamp: paths part where a draw is near a threshold. Normals that the file states, which
    are other than those by more than rounding, are kept.
    """
    threads = dr.thread_count()
    dr.set_thread_count(1)
    try:
        for shape in scene.shapes():
            # Rectangles call themselves meshes, without any
            if "vertex_normals" in mi.traverse(shape) and not shape.has_face_normals():
                _settle_mesh(shape)
    finally:
        dr.set_thread_count(threads)


def _settle_mesh(mesh: mi.Mesh) -> None:
    stated = np.array(mi.traverse(mesh)["vertex_normals"]).reshape(-1, 3)
    mesh.recompute_vertex_normals()
    parameters = mi.traverse(mesh)
    found = np.array(parameters["vertex_normals"]).reshape(-1, 3)
    other = (np.abs(found - stated) > ROUNDING).any(1, keepdims=True)
    parameters["vertex_normals"] = mi.Float(np.where(other, stated, found).ravel())
    parameters.update()
