"""Which triangles of a lamp are seen from outside it."""

from __future__ import annotations

from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from purelight_train.light.exit_surface import ExitSurface, proper

Float = NDArray[np.float32]
RAY_BATCH = 1 << 22
BACK_OFTEN = 0.02  # of the rays that meet a triangle, those that meet the side less seen
SEEN_BACK = 1e-3  # of the rays that meet a sheet, those that meet the side less seen
LEAVING_RAYS, PER_TRIANGLE = 1 << 22, (16, 256)  # from triangles that no ray from outside met


def visible_part(
    positions: Float,
    triangles: NDArray[np.uint32],
    vertex_normals: Float | None,
    rays: int,
    rng: np.random.Generator,
) -> ExitSurface:
    """Keep the triangles that rays from outside meet first, or leave without meeting another.

    Triangles without area and copies of others (same corners, either way round) are left out: a
    viewer meets one of the copies, but the light would be spread over all of them.

    A finite number of rays from outside misses what is seen rarely, as a bulb deep in a shade;
    rays from the missed triangles find it. Neighbours (triangles that share a vertex with a seen
    one) close the pinholes that are left.

    Arguments:
        positions: [V, 3] in metres.
        triangles: [T, 3].
        vertex_normals: [V, 3] of the scene's own shading; None if it is flat.
        rays: from outside.

    Raises:
        PureLightError: no triangle has an area.
    """
    solid = proper(positions, triangles)
    # Vertices of no triangle may be anywhere
    used, compact = np.unique(triangles[solid], return_inverse=True)
    positions, triangles = positions[used], compact.reshape(-1, 3).astype(np.uint32)
    vertex_normals = None if vertex_normals is None else vertex_normals[used]
    whole = ExitSurface(positions, triangles, np.zeros(len(triangles), bool))
    front, back = _met(whole, rays, rng)
    missed = np.flatnonzero(front + back == 0)
    leaving = np.stack((front, back))
    leaving[:, missed] = _leaving(whole, missed, rng)
    _, place = np.unique(positions, axis=0, return_inverse=True)
    corner = place.reshape(-1)[triangles]
    keep = _touching(corner, leaving.sum(axis=0) > 0)
    turned = leaving[1] > leaving[0]
    facing_out = np.where(turned[:, None], triangles[:, ::-1], triangles)
    used, compact = np.unique(facing_out[keep], return_inverse=True)
    return ExitSurface(
        positions[used],
        compact.reshape(-1, 3).astype(np.uint32),
        _two_sided(corner, front, back)[keep],
        None if vertex_normals is None else vertex_normals[used],
        source=solid[keep],
        turned=turned[keep],
    )


def _met(surface: ExitSurface, rays: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """How many of uniform lines through the sphere first meet triangles' front and back: [2, T]."""
    centre = dr.opaque(mi.Point3f, surface.sphere.center)
    radius = dr.opaque(mi.Float, 1.0001 * surface.sphere.radius)
    triangles = dr.opaque(mi.UInt32, len(surface.triangles))
    met = dr.zeros(mi.UInt32, 2 * len(surface.triangles))
    for _, sampler in _batches(rays, rng):
        outward = mi.Normal3f(mi.warp.square_to_uniform_sphere(sampler.next_2d()))
        ray = mi.Ray3f(centre + radius * outward, _about(-outward, sampler))
        hit = surface.scene.ray_intersect(ray, +mi.RayFlags.Minimal, coherent=False)
        back = dr.select(dr.dot(hit.n, ray.d) > 0, triangles, 0)
        dr.scatter_add(met, mi.UInt32(1), hit.prim_index + back, hit.is_valid())
    return np.array(met).astype(np.int64).reshape(2, -1)


def _leaving(
    surface: ExitSurface, triangle: NDArray[np.int64], rng: np.random.Generator
) -> NDArray[np.int64]:
    """How many rays from triangles [N], as many each, leave from front and back: [2, N]."""
    if not len(triangle):
        return np.zeros((2, 0), np.int64)
    each = int(np.clip(LEAVING_RAYS // (2 * len(triangle)), *PER_TRIANGLE))
    part, lift = dr.opaque(mi.UInt32, each), dr.opaque(mi.Float, 1e-5 * surface.sphere.radius)
    outward = surface.outward_normals()[triangle]
    corners = [mi.Point3f(surface.positions[c].T) for c in surface.triangles[triangle].T]
    leaving = [dr.zeros(mi.UInt32, len(triangle)) for _ in range(2)]
    for side, count in zip((1, -1), leaving, strict=True):
        normals = mi.Normal3f((side * outward).T)
        for number, sampler in _batches(each * len(triangle), rng):
            chosen = number // part
            normal = dr.gather(mi.Normal3f, normals, chosen)
            lifted = _within(corners, chosen, sampler) + lift * normal
            met = surface.scene.ray_test(mi.Ray3f(lifted, _about(normal, sampler)), coherent=False)
            dr.scatter_add(count, mi.UInt32(1), chosen, ~met)
    return np.stack([np.array(count) for count in leaving]).astype(np.int64)


def _about(normal: mi.Normal3f, sampler: mi.Sampler) -> mi.Vector3f:
    """Directions about normals with pdf cos(theta)/pi per solid angle."""
    local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
    return mi.Frame3f(normal).to_world(local)


def _within(corners: list[mi.Point3f], chosen: mi.UInt32, sampler: mi.Sampler) -> mi.Point3f:
    """Points of chosen triangles, uniform by area."""
    a, b, c = (dr.gather(mi.Point3f, corner, chosen) for corner in corners)
    u, v = mi.warp.square_to_uniform_triangle(sampler.next_2d())
    return a + u * (b - a) + v * (c - a)


def _batches(count: int, rng: np.random.Generator) -> Iterator[tuple[mi.UInt32, mi.Sampler]]:
    """Numbers of rays [N], and what draws for them, in as many kernels of the same code."""
    sampler = mi.load_dict({"type": "independent"})
    for first in range(0, count, RAY_BATCH):
        size = min(RAY_BATCH, count - first)
        sampler.seed(int(rng.integers(1 << 32)), size)
        yield dr.arange(mi.UInt32, size) + dr.opaque(mi.UInt32, first), sampler


def _touching(corner: NDArray[np.int64], seen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Triangles [T] that are seen or share a vertex with such a one; corners as in `_sheets`."""
    touched = np.zeros(corner.max() + 1, bool)
    touched[corner[seen]] = True
    result: NDArray[np.bool_] = np.asarray(touched[corner].any(axis=1))
    return result


def _two_sided(
    corner: NDArray[np.int64], front: NDArray[np.int64], back: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which triangles are of thin sheets: [T]; arguments as of `_sheets`.

    A closed mesh shows its back only through rounding at edges; a sheet shows it often, unless it
    is deep, but then as a whole.
    """
    often = np.minimum(front, back) > BACK_OFTEN * (front + back)
    return often | _sheets(corner, front, back)


def _sheets(
    corner: NDArray[np.int64], front: NDArray[np.int64], back: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Which triangles belong to a mesh with an open edge that shows both sides: [T].

    Arguments:
        corner: [T, 3] of the triangles, equal where they touch.
        front, back: rays that met either side: [T].
    """
    edge = np.sort(corner[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
    _, first, faces = np.unique(edge, axis=0, return_inverse=True, return_counts=True)
    row, column = edge.T
    links = coo_matrix((np.ones(len(edge)), (row, column)), (corner.max() + 1,) * 2)
    part = connected_components(links, directed=False)[1][corner[:, 0]]
    is_open = np.bincount(part, (faces[first.ravel()] == 1).reshape(-1, 3).any(1)) > 0
    seen = [np.bincount(part, count) for count in (front, back)]
    both = np.minimum(*seen) > SEEN_BACK * (seen[0] + seen[1])
    result: NDArray[np.bool_] = (is_open & both)[part]
    return result
