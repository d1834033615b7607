"""What must hold of a lamp's geometry before any light is traced in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from trimesh.ray.ray_pyembree import RayMeshIntersector

Floats = NDArray[np.float64]
AWAY = np.array([0.5773, 0.4142, 0.7038])  # a direction that no lamp is aligned to


@dataclass(frozen=True)
class Body:
    """A part of a lamp.

    Arguments:
        solid: whether its walls are closed and their normals leave what it is made of.
    """

    name: str
    mesh: trimesh.Trimesh
    solid: bool = True


@dataclass(frozen=True)
class Shell:
    """One connected surface of a body, as triangles of merged corners."""

    body: Body
    mesh: trimesh.Trimesh

    @cached_property
    def rays(self) -> RayMeshIntersector:
        return RayMeshIntersector(self.mesh, scale_to_box=False)

    @cached_property
    def bounds(self) -> Floats:
        """Its least and greatest coordinates: [2, 3]."""
        bounds: Floats = self.mesh.bounds
        return bounds

    @cached_property
    def edges(self) -> Floats:
        """Ends of its edges: [E, 2, 3]."""
        ends: Floats = self.mesh.vertices[self.mesh.edges_unique]
        return ends


def faults(bodies: Sequence[Body]) -> list[str]:
    """All that is wrong with a lamp's geometry, in words; nothing if it is sound."""
    found = [fault for body in bodies for fault in _body_faults(body)]
    if found:
        return found
    shells = [shell for body in bodies for shell in split(body)]
    found += [
        f"{a.body.name} and {b.body.name} meet" for a, b in combinations(shells, 2) if meet(a, b)
    ]
    return found + list(_depth_faults(shells))


def split(body: Body) -> list[Shell]:
    """The connected surfaces of a body; corners at one place are one."""
    mesh = body.mesh
    corners, index = np.unique(mesh.vertices.round(12), axis=0, return_inverse=True)
    faces = index.reshape(-1)[mesh.faces]
    pairs = np.concatenate((faces[:, :2], faces[:, 1:]))
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), (len(corners), len(corners)))
    count, label = connected_components(graph, directed=False)
    made = [
        trimesh.Trimesh(corners, faces[label[faces[:, 0]] == k], process=False)
        for k in range(count)
    ]
    for part in made:
        part.remove_unreferenced_vertices()
    return [Shell(body, part) for part in made if len(part.faces)]


def meet(a: Shell, b: Shell) -> bool:
    """Whether an edge of one surface passes through the other, or touches it."""
    (a_low, a_high), (b_low, b_high) = a.bounds, b.bounds
    if (a_high < b_low).any() or (b_high < a_low).any():
        return False
    return _pierced(a, b) or _pierced(b, a)


def _body_faults(body: Body) -> Iterator[str]:
    mesh = body.mesh
    if not np.isfinite(mesh.vertices).all():
        yield f"{body.name} has corners that are no numbers"
        return
    if mesh.area_faces.min() <= 1e-12:
        yield f"{body.name} has a triangle without area"
    if not body.solid:
        return
    for shell in split(body):
        if not (shell.mesh.is_watertight and shell.mesh.is_winding_consistent):
            yield f"{body.name} is not closed"


def _pierced(a: Shell, b: Shell) -> bool:
    """Whether an edge of `a` meets a triangle of `b`."""
    low, high = b.bounds
    ends = a.edges
    near = ((ends.min(1) <= high) & (ends.max(1) >= low)).all(1)
    if not near.any():
        return False
    start, along = ends[near, 0], ends[near, 1] - ends[near, 0]
    length = np.linalg.norm(along, axis=1)
    direction = along / length[:, None]
    triangle = b.rays.intersects_first(start, direction)
    hit = np.flatnonzero(triangle >= 0)
    corner, normal = b.mesh.triangles[triangle[hit], 0], b.mesh.face_normals[triangle[hit]]
    slant = (normal * direction[hit]).sum(1)
    distance = ((corner - start[hit]) * normal).sum(1) / np.where(slant == 0, 1, slant)
    return bool((distance <= length[hit] * (1 + 1e-6)).any())


def _depth_faults(shells: list[Shell]) -> Iterator[str]:
    """Surfaces that stand inside a body: how often others go around them must be none.

    A hollow is cut out of its own body, so that goes around it once.
    """
    solids = [s for s in shells if s.body.solid]
    for shell in shells:
        hollow = shell.body.solid and shell.mesh.volume < 0
        at = shell.mesh.vertices[0]
        depth = sum(_winding(solid, at) for solid in solids if solid is not shell)
        if depth != (1 if hollow else 0):
            yield f"{shell.body.name} stands in {depth} bodies"


def _winding(shell: Shell, point: Floats) -> int:
    """How often a closed surface goes around a point: -1 for a hollow."""
    low, high = shell.bounds
    if (point < low).any() or (point > high).any():
        return 0
    a, b, c = (shell.mesh.triangles[:, k] - point for k in range(3))
    sides = [np.cross(p, q) @ AWAY for p, q in ((a, b), (b, c), (c, a))]
    front = np.all([s > 0 for s in sides], 0)
    back = np.all([s < 0 for s in sides], 0)
    ahead = (a * np.cross(b - a, c - a)).sum(1) * np.where(front, 1, -1) > 0
    return int((front & ahead).sum() - (back & ahead).sum())
