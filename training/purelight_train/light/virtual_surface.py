"""A convex surface around rays, for light whose lamp is not known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from purelight_format.errors import PureLightError
from purelight_format.ray_file.rays import Rays
from purelight_train.light.direction_zones import fibonacci_lattice

START, TIGHT, AUTO = "start", "tight", "auto"
SIDES = 512
THICKNESS = 1e-3  # Of the extent: between the rays' beginnings and the hull.
TIGHTER = 0.8  # Of the radius of the other hull, from which on `auto` takes the tight one.
CHUNK = 1 << 16
Float = NDArray[np.float32]
Double = NDArray[np.float64]


def virtual_surface(rays: Rays, choice: str = AUTO) -> tuple[Float, NDArray[np.uint32], str]:
    """Vertices [V, 3] and triangles [T, 3], wound outwards, that every ray leaves; what they are.

    Arguments:
        choice: `START`, the convex hull of where rays start; `TIGHT`, that of the points of their
            lines nearest their common focus, which is smaller for rays that were measured on a
            surface far around the lamp; `AUTO`, the tight one where it is much smaller.

    Raises:
        PureLightError: The rays start, or pass, at one point, which has no radiance.
    """
    points = {START: rays.position.astype(np.float64)}
    if choice != START:
        points[TIGHT] = nearest_to_focus(rays)
    if choice == AUTO:
        start, tight = (_radius(points[name]) for name in (START, TIGHT))
        choice = TIGHT if 0 < tight < TIGHTER * start else START
    return *hull(points[choice]), choice


def nearest_to_focus(rays: Rays) -> Double:
    r"""The points of rays' lines nearest the point that is nearest to all of them: [N, 3].

    The focus solves :math:`\sum_i w_i (1 - k_i k_i^T)(x_i - f) = 0`.
    """
    position, direction = (a.astype(np.float64) for a in (rays.position, rays.direction))
    weight = rays.power.sum(1, dtype=np.float64)
    weight /= weight.sum()
    along = np.einsum("nd,nd->n", position, direction)
    matrix = np.eye(3) - np.einsum("n,nd,ne->de", weight, direction, direction)
    right = weight @ (position - along[:, None] * direction)
    focus = np.linalg.lstsq(matrix, right, rcond=1e-6)[0]
    ahead = np.einsum("nd,nd->n", focus - position, direction)
    result: Double = position + ahead[:, None] * direction
    return result


def hull(points: Double, sides: int = SIDES) -> tuple[Float, NDArray[np.uint32]]:
    """A convex polyhedron of moderate size just around points [N, 3]: vertices, triangles.

    It is bounded by planes against which the points lean, in directions all around.

    Arguments:
        sides: how many directions there are besides those of a box's faces, edges and corners.

    Raises:
        PureLightError: All points are one.
    """
    middle, extent = 0.5 * (points.min(0) + points.max(0)), float(np.ptp(points, axis=0).max())
    if not extent > 0:
        raise PureLightError(
            "all rays pass one point, so that they have no radiance; give the lamp's surface "
            "with --exit-surface"
        )
    normal = _directions(sides)
    bound = np.full(len(normal), -np.inf)
    for first in range(0, len(points), CHUNK):
        unit = (points[first : first + CHUNK] - middle) / extent
        bound = np.maximum(bound, (unit @ normal.T).max(0))
    planes = np.column_stack([normal, -bound - THICKNESS])
    try:
        corners = HalfspaceIntersection(planes, np.zeros(3)).intersections
        mesh = ConvexHull(corners)
    except QhullError as error:
        raise PureLightError("no surface can be laid around the rays") from error
    used, faces = np.unique(mesh.simplices, return_inverse=True)
    triangles = _outwards(corners[used], faces.reshape(-1, 3))
    return (corners[used] * extent + middle).astype(np.float32), triangles


def read_surface(path: Path) -> tuple[Float, NDArray[np.uint32]]:
    """Vertices and triangles of a mesh file, in metres, whose every side faces outwards.

    Raises:
        PureLightError: It is no mesh.
    """
    if not path.is_file():
        raise PureLightError(f"{path}: no such file; give a mesh in metres (.ply, .obj, .stl)")
    try:
        mesh = trimesh.load(path, force="mesh", process=False)
        positions, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:
        raise PureLightError(f"{path}: not a mesh that can be read") from error
    if not len(faces) or not np.isfinite(positions).all():
        raise PureLightError(f"{path}: holds no triangles")
    return positions.astype(np.float32), faces.astype(np.uint32)


def _directions(sides: int) -> Double:
    """Unit vectors all around: the 26 of a cube's faces, edges and corners, and a spiral."""
    grid = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), -1).reshape(-1, 3)
    cube = grid[np.abs(grid).sum(1) > 0]
    return np.concatenate(
        [cube / np.linalg.norm(cube, axis=1, keepdims=True), fibonacci_lattice(sides)]
    )


def _outwards(corners: Double, faces: NDArray[np.int64]) -> NDArray[np.uint32]:
    """Triangles of a convex body around the origin, wound so that they face away from it."""
    a, b, c = corners[faces.T]
    inwards = np.einsum("td,td->t", np.cross(b - a, c - a), a) < 0
    return np.where(inwards[:, None], faces[:, ::-1], faces).astype(np.uint32)


def _radius(points: Double) -> float:
    return float(np.linalg.norm(points - 0.5 * (points.min(0) + points.max(0)), axis=1).max())
