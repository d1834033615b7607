"""Rays among a lamp's parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.ray.ray_pyembree import RayMeshIntersector

from purelight_import.model.lamp import Part
from purelight_import.model.mesh import Floats, Mesh, joined

LIFT = 1e-5  # of the extent, off the surface that a ray starts from
INSIDE_RAYS = 5


@dataclass(frozen=True)
class Rays:
    """The triangles of some meshes, to be met by rays."""

    mesh: Mesh

    @staticmethod
    def among(meshes: Sequence[Mesh]) -> Rays:
        return Rays(joined([replace(m, normals=None, uv=None) for m in meshes]))

    @cached_property
    def extent(self) -> float:
        return float(np.ptp(self.mesh.bounds, axis=0).max())

    @cached_property
    def _intersector(self) -> RayMeshIntersector:
        made = trimesh.Trimesh(self.mesh.positions, self.mesh.triangles, process=False)
        return RayMeshIntersector(made, scale_to_box=False)

    def distances(self, origin: Floats, direction: Floats) -> Floats:
        """How far rays [N, 3] go before they meet something; infinite if nothing: [N]."""
        result = np.full(len(origin), np.inf)
        _, ray, place = self._intersector.intersects_id(
            origin, direction, multiple_hits=False, return_locations=True
        )
        result[ray] = np.linalg.norm(place - origin[ray], axis=1)
        return result

    def inside(self, point: Floats) -> bool:
        """Whether a point is inside: most rays from it meet an odd number of triangles."""
        direction = directions(INSIDE_RAYS, np.random.default_rng(1))
        origin = np.tile(point, (INSIDE_RAYS, 1))
        _, ray = self._intersector.intersects_id(origin, direction, multiple_hits=True)
        odd = np.bincount(ray, minlength=INSIDE_RAYS) % 2
        return bool(odd.sum() > INSIDE_RAYS / 2)


def directions(count: int, rng: np.random.Generator) -> Floats:
    """Even directions: [count, 3]."""
    result = rng.normal(size=(count, 3))
    return result / np.linalg.norm(result, axis=1, keepdims=True)


def leaving(part: Part, count: int, side: int, lift: float) -> tuple[Floats, Floats]:
    """Rays from points even over a part's area, cosine-weighted about one side's normal.

    Arguments:
        side: 1 of the front, -1 of the back.
        lift: metres off the surface.

    Returns:
        Origins and directions, [count, 3] each.
    """
    rng = np.random.default_rng(0)
    areas = part.mesh.areas
    which = rng.choice(len(areas), count, p=areas / areas.sum())
    normal = part.mesh.cross[which]
    normal *= side / np.linalg.norm(normal, axis=1, keepdims=True)
    root, v = np.sqrt(rng.random(count)), rng.random(count)
    weight: NDArray[np.float64] = np.stack((1 - root, root * (1 - v), root * v), 1)
    origin = np.einsum("nk,nkd->nd", weight, part.mesh.corners[which]) + lift * normal
    direction = directions(count, rng) + 1.000001 * normal
    return origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)
