"""An exit surface with fewer triangles where it is flat, or nearly so.

The code is our own (`edge_collapse`): fast-simplification takes a number of triangles, knows
neither a tolerance nor borders, and moved vertices of cut glass by 38 tolerances; meshoptimizer has
no wheels with its simplifier, manifold takes closed meshes alone, and pymeshlab is under the GPL.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from purelight_train.light.edge_collapse import collapsed
from purelight_train.light.edge_ways import Mesh
from purelight_train.light.exit_surface import ExitSurface, proper

ANGLE = 20.0  # degrees: most that a normal may be turned
GAP = 3.0  # tolerances that have to fit between two walls
NEIGHBOURS = 8
LIFT = 1e-3  # of the tolerance
CORNERS = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4]]) / [[3], [6], [6], [6]]


def decimated(
    surface: ExitSurface, tolerance: float, label: NDArray[np.integer] | None = None
) -> ExitSurface:
    """The surface with fewer triangles; each is one of the original with corners moved.

    Arguments:
        tolerance: most that it is moved, over the radius of the bounding sphere; the surface as
            it is if zero.
        label: [T]; where triangles of different labels meet, the line between them stays. Those of
            a negative label stay as they are.
    """
    if tolerance <= 0:
        return surface
    reach = tolerance * surface.sphere.radius
    label = np.zeros(len(surface.triangles), np.int64) if label is None else label
    whole, corner = np.unique(surface.positions, axis=0, return_inverse=True)
    faces = corner.ravel()[surface.triangles].astype(np.int64)
    mesh = Mesh(
        whole.astype(np.float64), faces, np.arange(len(faces)), _labels(surface, label),
        surface.outward_normals(),
        np.where(label < 0, -1.0, np.minimum(reach, _gap(surface, reach) / GAP)),
    )  # fmt: skip
    solid = np.zeros(len(faces), bool)
    solid[proper(surface.positions, surface.triangles)] = True
    mesh = collapsed(mesh.take(solid), float(np.cos(np.radians(ANGLE))))
    kept = proper(whole, mesh.corners.astype(np.uint32))
    return _dressed(whole, mesh.corners[kept], mesh.number[kept], surface)


def _labels(surface: ExitSurface, label: NDArray[np.integer]) -> NDArray[np.int64]:
    """Different where anything is told of triangles that is not equal: [T]."""
    columns: list[NDArray[Any]] = [label, surface.two_sided]
    columns += [c for c in (surface.virtual, surface.turned) if c is not None]
    if surface.vertex_normals is not None:
        columns.append((surface.vertex_normals != 0)[surface.triangles].any((1, 2)))
    return np.unique(np.stack(columns, 1).astype(np.int64), axis=0, return_inverse=True)[1].ravel()


def _gap(surface: ExitSurface, reach: float) -> NDArray[np.float64]:
    """How far triangles are from what they face on either side, infinite if farther than counts."""
    result = np.full(len(surface.triangles), np.inf)
    corner = surface.positions[surface.triangles]
    for weight in CORNERS:
        middle = np.einsum("k,tkd->td", weight, corner)
        for side in (1, -1):
            normal = (side * surface.outward_normals()).astype(np.float32)
            origin = (middle + LIFT * reach * normal).astype(np.float32)
            hits = surface.intersect(origin, normal)
            away = np.linalg.norm(hits.position - middle[hits.index], axis=1)
            result[hits.index] = np.minimum(result[hits.index], away)
    return result


def _dressed(
    positions: NDArray[np.float32], faces: NDArray[np.int64], number: NDArray[np.int64],
    original: ExitSurface,
) -> ExitSurface:  # fmt: skip
    """Triangles with what is told of those of these numbers in the original."""
    names = ("two_sided", "virtual", "source", "turned")
    told: dict[str, Any] = {name: getattr(original, name) for name in names}
    told = {name: None if column is None else column[number] for name, column in told.items()}
    used, compact = np.unique(faces, return_inverse=True)
    flat = ExitSurface(positions[used], compact.reshape(-1, 3).astype(np.uint32), **told)
    if original.vertex_normals is None:
        return flat
    normals = _normals(flat, original, original.vertex_normals, number)
    corners = flat.positions[flat.triangles]
    table = np.concatenate([corners, normals], axis=2).reshape(-1, 6)
    rows, index = np.unique(table, axis=0, return_inverse=True)
    place, shading = np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:])
    triangles = index.reshape(-1, 3).astype(np.uint32)
    return replace(flat, positions=place, triangles=triangles, vertex_normals=shading)


def _normals(
    flat: ExitSurface, original: ExitSurface, smooth: NDArray[np.float32],
    number: NDArray[np.int64],
) -> NDArray[np.float32]:  # fmt: skip
    """Shading normals of the triangles' corners, [T, 3, 3]: what fits best of those in its place.

    Triangles that were flat have none.
    """
    bent = (smooth != 0)[original.triangles].any((1, 2))[number]
    result = np.zeros((len(bent), 3, 3), np.float32)
    known = np.flatnonzero(smooth.any(1))
    if not bent.any():
        return result
    nearest = np.arange(1, min(NEIGHBOURS, len(known)) + 1)
    distance, near = cKDTree(original.positions[known]).query(
        flat.positions[flat.triangles[bent]], k=nearest
    )
    fit = np.einsum("tckd,td->tck", smooth[known[near]], flat.outward_normals()[bent])
    fit[distance > 0] = -2  # Corners are corners of the original.
    best = np.take_along_axis(near, fit.argmax(2)[..., None], 2)[..., 0]
    result[bent] = smooth[known[best]]
    return result
