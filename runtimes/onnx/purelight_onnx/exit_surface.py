"""Rays against the exit surface of a luminaire, with Embree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.measures import BoundingSphere
from purelight_format.members.surface import Surface

NEAR = 2.0  # Radii before the point nearest the centre at which far rays begin.


@dataclass(frozen=True)
class Hits:
    """The rays that meet the surface.

    Arguments:
        ray: [M] index of the ray.
        triangle: [M] index of the triangle.
        position: [M, 3] in metres.
        normal: [M, 3] geometric unit normals, turned against the ray.
    """

    ray: np.ndarray
    triangle: np.ndarray
    position: np.ndarray
    normal: np.ndarray


class ExitSurface:
    """The triangles of a luminaire, in units of its radius, so that any lamp is of size one.

    Attributes:
        area: [T] of the triangles, in m².
    """

    def __init__(self, surface: Surface, sphere: BoundingSphere) -> None:
        # Slow to load, and few who open a lamp ask what rays meet.
        import trimesh
        from trimesh.ray.ray_pyembree import RayMeshIntersector

        self.centre, self.radius = np.array(sphere.center, np.float64), sphere.radius
        vertices = (surface.positions.astype(np.float64) - self.centre) / self.radius
        self.corner = vertices[surface.triangles]
        cross = np.cross(
            self.corner[:, 1] - self.corner[:, 0], self.corner[:, 2] - self.corner[:, 0]
        )
        double = np.linalg.norm(cross, axis=1, keepdims=True)
        self.normal = cross / np.where(double > 0, double, 1)
        self.area = double[:, 0] / 2 * self.radius**2
        mesh = trimesh.Trimesh(vertices, surface.triangles, process=False)
        self._embree = RayMeshIntersector(mesh, scale_to_box=False)

    def intersect(self, origin: np.ndarray, direction: np.ndarray) -> Hits:
        """First hits of rays: origins in metres and unit directions, [N, 3] each."""
        start = (origin - self.centre) / self.radius
        # Embree has float32, in which a far origin would put the hit beside the triangle.
        way = np.maximum(-(start * direction).sum(1, keepdims=True) - NEAR, 0)
        start = start + way * direction
        triangle = self._embree.intersects_first(start, direction)
        ray = np.flatnonzero(triangle >= 0)
        triangle, start, direction = triangle[ray], start[ray], direction[ray]
        normal = self.normal[triangle]
        cosine = (direction * normal).sum(1)
        solid = np.abs(cosine) > 0
        ray, triangle, start, direction = (v[solid] for v in (ray, triangle, start, direction))
        normal, cosine = normal[solid], cosine[solid]
        depth = ((self.corner[triangle, 0] - start) * normal).sum(1) / cosine
        position = self.centre + self.radius * (start + depth[:, None] * direction)
        return Hits(ray, triangle, position, np.where(cosine[:, None] > 0, -normal, normal))

    def point(self, triangle: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Points [N, 3] in metres, even on triangles [N], from squares [N, 2]."""
        root = np.sqrt(u[:, :1])
        a, b, c = np.moveaxis(self.corner[triangle], 1, 0)
        inside = a + root * ((1 - u[:, 1:]) * (b - a) + u[:, 1:] * (c - a))
        return self.centre + self.radius * inside
