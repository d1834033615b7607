"""How much a lamp's outside sees of itself."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.ray.ray_pyembree import RayMeshIntersector


def self_view(body: trimesh.Trimesh, radius: float, rays: int = 4096) -> float:
    """Part of the diffuse light from a body's outside that meets it again.

    Lines through the sphere about the origin find the outside; what leaves it is drawn by cosine.
    """
    rng = np.random.default_rng(0)
    start, aim, kick = (_unit(rng.normal(size=(rays, 3))) for _ in range(3))
    inward = _unit(aim - 1.000001 * start)
    embree = RayMeshIntersector(body, scale_to_box=False)
    origin = 1.001 * radius * start
    triangle = embree.intersects_first(origin, inward)
    met = triangle >= 0
    origin, inward, triangle = origin[met], inward[met], triangle[met]
    normal = body.face_normals[triangle]
    slant = (normal * inward).sum(1)
    depth = ((body.triangles[triangle, 0] - origin) * normal).sum(1) / slant
    normal = np.where(slant[:, None] > 0, -normal, normal)
    leaving = _unit(normal + 0.999999 * kick[met])
    lifted = origin + depth[:, None] * inward + 1e-4 * radius * normal
    return float(embree.intersects_any(lifted, leaving).mean())


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    result: NDArray[np.float64] = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return result
