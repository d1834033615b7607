"""Lights without a size, which have no radiance, as small spheres and disks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from purelight_import.model.lamp import Lamp, Part, PointLight
from purelight_import.model.material import RGB, Material
from purelight_import.model.mesh import Floats, Mesh, joined

LARGEST, SHARE = 0.005, 0.04  # metres, and of the lamp's extent
ROOM_LEFT = 0.5  # of the way to the next surface
DIRECTIONS, STEPS = 256, 4096
BLACK = Material("light source", (0.0, 0.0, 0.0), 0.0, 1.0, specular=0.0)


def with_size(lamp: Lamp) -> Lamp:
    """The lamp, in metres, with parts in place of its point lights."""
    if not lamp.points:
        return lamp
    size = float(np.ptp(lamp.bounds, axis=0).max()) if lamp.parts else 0.0
    extent = min(LARGEST, SHARE * size) if size > 0 else LARGEST
    scene = _intersector([p.mesh for p in lamp.parts])
    made = [_part(point, _radius(point, extent, scene)) for point in lamp.points]
    for point in lamp.points:
        if point.cone is None:
            lamp.notes("point lights are taken as small spheres, since points have no radiance",
                       point.name)  # fmt: skip
        else:
            lamp.notes("spots are taken as small disks of the same power; their cone is left out",
                       point.name)  # fmt: skip
    return replace(lamp, parts=(*lamp.parts, *made), points=())


def _part(point: PointLight, radius: float) -> Part:
    """A sphere or, for a spot, a disk, of the light's power."""
    if point.cone is None:
        made = trimesh.creation.icosphere(subdivisions=3, radius=radius)
        vertices = np.array(made.vertices) + point.position
        mesh, solid_angle = Mesh(vertices, np.array(made.faces, np.uint32)), 4 * np.pi
    else:
        mesh, solid_angle = _disk(point, radius), spot_solid_angle(*point.cone)
    r, g, b = (i * solid_angle / (np.pi * mesh.area) for i in point.intensity)
    radiance: RGB = (float(r), float(g), float(b))
    return Part(point.name, mesh, BLACK, point.path, radiance)


def spot_solid_angle(inner: float, outer: float) -> float:
    """Solid angle of a spot's cone weighted by its falloff (KHR_lights_punctual).

    The falloff is the square of (cos θ - cos outer) / (cos inner - cos outer), cut to [0, 1]; of
    equal angles it is an edge, by which other formats say how large their own falloff's is.
    """
    if inner >= outer:
        return float(2 * np.pi * (1 - np.cos(outer)))
    cosine = np.linspace(np.cos(outer), 1, STEPS)
    width = max(np.cos(inner) - np.cos(outer), 1e-3)
    falloff = np.clip((cosine - np.cos(outer)) / width, 0, 1) ** 2
    return float(2 * np.pi * falloff.mean() * (1 - np.cos(outer)))


def _disk(point: PointLight, radius: float) -> Mesh:
    """A disk that faces a spot's direction."""
    axis = point.direction
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)[:, None]
    ring = point.position + radius * (np.cos(angle) * first + np.sin(angle) * second)
    i = np.arange(32)
    faces = np.stack((np.zeros_like(i), i + 1, (i + 1) % 32 + 1), 1).astype(np.uint32)
    return Mesh(np.concatenate((point.position[None], ring)), faces)


def _radius(point: PointLight, extent: float, scene: RayMeshIntersector | None) -> float:
    """A radius at which the source touches nothing."""
    radius = point.radius or extent
    if scene is None:
        return radius
    rng = np.random.default_rng(0)
    direction = rng.normal(size=(DIRECTIONS, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    origin = np.tile(point.position, (DIRECTIONS, 1))
    places, _, _ = scene.intersects_location(origin, direction, multiple_hits=False)
    nearest = _nearest(places, point.position)
    return max(min(radius, ROOM_LEFT * nearest), 1e-3 * extent)


def _nearest(places: Floats, position: Floats) -> float:
    return float(np.linalg.norm(places - position, axis=1).min()) if len(places) else np.inf


def _intersector(meshes: Sequence[Mesh]) -> RayMeshIntersector | None:
    if not meshes:
        return None
    flat = [replace(m, normals=None, uv=None) for m in meshes]
    whole = joined(flat)
    made = trimesh.Trimesh(whole.positions, whole.triangles, process=False)
    return RayMeshIntersector(made, scale_to_box=False)
