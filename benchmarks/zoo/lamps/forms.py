"""Shapes of parts: triangles, or one of Mitsuba's shapes by formula."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from benchmarks.zoo.lamps.placement import Floats, apply


@dataclass(frozen=True)
class Mesh:
    """Triangles, with texture coordinates [V, 2] or none; `smooth` bends normals over facets."""

    triangles: trimesh.Trimesh
    uv: Floats | None = None
    smooth: bool = False

    def moved(self, matrix: Floats) -> Mesh:
        copy = self.triangles.copy()
        copy.vertices = apply(matrix, copy.vertices)
        return replace(self, triangles=copy)


@dataclass(frozen=True)
class Primitive:
    """One of Mitsuba's shapes of unit size: sphere, rectangle, disk or (open) cylinder.

    Arguments:
        matrix: [4, 4] a similarity; that of a cylinder, rectangle or disk may scale its axes.
        flipped: whether its normals are turned around.
    """

    kind: str
    matrix: Floats
    flipped: bool = False

    def moved(self, matrix: Floats) -> Primitive:
        return replace(self, matrix=matrix @ self.matrix)

    @property
    def triangles(self) -> trimesh.Trimesh:
        """About the same as triangles."""
        made = {
            "sphere": lambda: trimesh.creation.icosphere(subdivisions=3),
            "rectangle": lambda: trimesh.Trimesh(
                [[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], [[0, 1, 2], [0, 2, 3]]
            ),
            "disk": _disk,
            "cylinder": _cylinder,
        }[self.kind]()
        made.vertices = apply(self.matrix, made.vertices)
        if self.flipped:
            made.invert()
        return made


def _disk() -> trimesh.Trimesh:
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    vertices = np.c_[np.cos(angle), np.sin(angle), np.zeros(64)]
    i = np.arange(64)
    faces = np.stack((i, (i + 1) % 64, np.full(64, 64)), 1)
    return trimesh.Trimesh(np.r_[vertices, [[0, 0, 0]]], faces, process=False)


def _cylinder() -> trimesh.Trimesh:
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    ring = np.stack((np.cos(angle), np.sin(angle)), 1)
    vertices = np.concatenate([np.c_[ring, np.full(64, z)] for z in (0.0, 1.0)])
    i = np.arange(64)
    j = (i + 1) % 64
    faces = np.concatenate((np.stack((i, j, i + 64), 1), np.stack((j, j + 64, i + 64), 1)))
    return trimesh.Trimesh(vertices, faces, process=False)
