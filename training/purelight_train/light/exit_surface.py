"""The exit surface: the triangles of a luminaire that can be seen from outside it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from purelight_format.errors import PureLightError
from purelight_format.geometry import BoundingSphere

Float = NDArray[np.float32]
RAY_BATCH = 1 << 20
CREASE_COSINE = 0.8  # facets that meet at less than 37 degrees are one smooth surface


@dataclass(frozen=True)
class Hits:
    """Rays that met the surface: `index` [M] of the ray, `position`, `normal` [M, 3], `triangle`.

    Normals are geometric and turned against the ray; `front` tells whether that is the side the
    triangle's winding faces.
    """

    index: NDArray[np.int64]
    position: Float
    normal: Float
    triangle: NDArray[np.uint32]
    front: NDArray[np.bool_]


def mitsuba_mesh(positions: Float, triangles: NDArray[np.uint32]) -> Any:
    """A Mitsuba mesh with face normals from positions [V, 3] and triangles [T, 3]."""
    props = mi.Properties()
    props["face_normals"] = True
    mesh = mi.Mesh("exit_surface", len(positions), len(triangles), props=props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(np.ravel(positions).astype(np.float32))
    parameters["faces"] = mi.UInt32(np.ravel(triangles).astype(np.uint32))
    parameters.update()
    return mesh


def bounding_sphere(positions: Float) -> BoundingSphere:
    """Nearly smallest sphere around points [V, 3] (Badoiu and Clarkson 2003, 500 steps)."""
    points = np.unique(positions.astype(np.float64), axis=0)
    centre = 0.5 * (points.min(0) + points.max(0))
    for step in range(500):
        far = points[np.argmax(((points - centre) ** 2).sum(1))]
        centre = centre + (far - centre) / (step + 2)
    radius = np.sqrt(((points - centre) ** 2).sum(1).max()) * (1 + 1e-4)
    return BoundingSphere((float(centre[0]), float(centre[1]), float(centre[2])), float(radius))


@dataclass(frozen=True)
class ExitSurface:
    """Triangles over vertices, wound so that their front is the side seen from outside.

    Arguments:
        positions: [V, 3] in metres.
        triangles: [T, 3].
        two_sided: [T] thin sheets that are seen, and so emit, from both sides.
    """

    positions: Float
    triangles: NDArray[np.uint32]
    two_sided: NDArray[np.bool_]

    @cached_property
    def sphere(self) -> BoundingSphere:
        return bounding_sphere(self.positions)

    @cached_property
    def scene(self) -> Any:
        return mi.load_dict(
            {"type": "scene", "surface": mitsuba_mesh(self.positions, self.triangles)}
        )

    @cached_property
    def _cross(self) -> NDArray[np.float64]:
        a, b, c = self.positions.astype(np.float64)[self.triangles.T]
        return np.cross(b - a, c - a)

    @cached_property
    def triangle_area(self) -> NDArray[np.float64]:
        """Emitting area of each triangle in m², both sides of a thin sheet: [T]."""
        return 0.5 * np.linalg.norm(self._cross, axis=1) * (1 + self.two_sided)

    @property
    def area(self) -> float:
        """Total area in m²."""
        return float(self.triangle_area.sum())

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Float, Float]:
        """Points uniform by area and their unit normals: two arrays [count, 3]."""
        weight = self.triangle_area / self.triangle_area.sum()
        chosen = rng.choice(len(weight), size=count, p=weight)
        return self._points(chosen, rng.random((2, count)), rng)

    def sample_evenly(self, count: int, rng: np.random.Generator) -> tuple[Float, Float]:
        """As `sample`, but spread out: sums over the points have far less noise.

        Triangles take turns in proportion to their area (systematic sampling), points within one
        follow the R2 sequence (Roberts 2018).
        """
        cumulative = np.cumsum(self.triangle_area)
        turn = (np.arange(count) + rng.random()) * (cumulative[-1] / count)
        chosen = np.minimum(np.searchsorted(cumulative, turn, "right"), len(cumulative) - 1)
        step = np.array([[0.7548776662466927], [0.5698402909980532]])
        return self._points(chosen, (rng.random((2, 1)) + step * np.arange(count)) % 1, rng)

    def _points(
        self, chosen: NDArray[np.int64], square: NDArray[np.float64], rng: np.random.Generator
    ) -> tuple[Float, Float]:
        """Points of triangles from numbers in the unit square, and their normals."""
        u, v = square
        root = np.sqrt(u)
        bary = np.stack((1 - root, root * (1 - v), root * v), 1)
        corner = self.positions[self.triangles[chosen]]
        normal = self._cross[chosen] / np.linalg.norm(self._cross[chosen], axis=1, keepdims=True)
        normal[self.two_sided[chosen] & (rng.random(len(chosen)) < 0.5)] *= -1
        point = np.einsum("nk,nkd->nd", bary, corner)
        return point.astype(np.float32), normal.astype(np.float32)

    @cached_property
    def _corner_normals(self) -> Float:
        """Normal at each corner, averaged by area over neighbours within the crease: [T, 3, 3]."""
        _, vertex = np.unique(self.positions, axis=0, return_inverse=True)
        corner = vertex.reshape(-1)[self.triangles].reshape(-1)
        owner = np.repeat(np.arange(len(self.triangles)), 3)
        count = len(owner)
        incidence = csr_matrix((np.ones(count), (corner, owner)), (corner.max() + 1, count // 3))
        pairs = (incidence[corner] * 1.0).tocoo()
        unit = self._cross / np.maximum(np.linalg.norm(self._cross, axis=1, keepdims=True), 1e-300)
        alike = np.einsum("nd,nd->n", unit[owner[pairs.row]], unit[pairs.col]) > CREASE_COSINE
        smooth = csr_matrix(
            (np.ones(alike.sum()), (pairs.row[alike], pairs.col[alike])), (count, count // 3)
        )
        total = smooth @ self._cross
        total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)
        return total.reshape(-1, 3, 3).astype(np.float32)

    def shading_normals(self, position: Float, normal: Float, triangle: NDArray[np.int64]) -> Float:
        """Interpolated normals on the side of `normal`; `normal` itself where triangle is -1.

        Only training uses them, to describe directions in a frame without jumps between facets
        (the paper's local shading frame). Assets and runtimes use geometric normals.

        Arguments:
            position, normal: [N, 3] points and oriented geometric normals.
            triangle: [N] triangle of each point, or -1.
        """
        known = np.flatnonzero(triangle >= 0)
        chosen = triangle[known]
        a, b, c = (self.positions[self.triangles[chosen, k]].astype(np.float64) for k in range(3))
        cross = self._cross[chosen]
        area = np.maximum(np.einsum("nd,nd->n", cross, cross), 1e-300)
        at = position[known].astype(np.float64)
        v = np.einsum("nd,nd->n", np.cross(c - b, at - b), cross) / area
        w = np.einsum("nd,nd->n", np.cross(a - c, at - c), cross) / area
        weight = np.clip(np.stack((v, w, 1 - v - w), 1), 0, 1)
        smooth = np.einsum("nk,nkd->nd", weight, self._corner_normals[chosen])
        smooth *= np.sign(np.einsum("nd,nd->n", smooth, normal[known]))[:, None]
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        result = normal.copy()
        result[known] = np.where(length > 0.1, smooth / np.maximum(length, 0.1), normal[known])
        return result

    def intersect(self, origin: Float, direction: Float) -> Hits:
        """First hits of rays, origins and unit directions [N, 3] in the luminaire frame."""
        parts = [
            self._intersect(origin[i : i + RAY_BATCH], direction[i : i + RAY_BATCH], i)
            for i in range(0, len(origin), RAY_BATCH)
        ]
        return Hits(
            *(np.concatenate([getattr(p, f) for p in parts]) for f in Hits.__dataclass_fields__)
        )

    def _intersect(self, origin: Float, direction: Float, first: int) -> Hits:
        ray = mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction.T))
        si = self.scene.ray_intersect_preliminary(ray, coherent=False)
        full = si.compute_surface_interaction(ray, +mi.RayFlags.Minimal)
        index = np.flatnonzero(np.array(si.is_valid()))
        front = dr.dot(full.n, ray.d) <= 0
        dr.eval(si, full, front)
        normal = np.array(dr.select(front, full.n, -full.n)).T[index]
        position = np.array(full.p).T[index]
        triangle = np.array(si.prim_index)[index].astype(np.uint32)
        return Hits(index + first, position, normal, triangle, np.array(front)[index])


def inward_rays(
    sphere: BoundingSphere, count: int, rng: np.random.Generator, *, cosine: bool
) -> tuple[Float, Float]:
    """Rays from uniform points on the sphere into it: origins and directions [count, 3].

    `cosine` directions make lines uniform through the sphere; otherwise they are uniform on the
    hemisphere towards the centre, as in the paper's Sec. 3.3.
    """
    outward = rng.normal(size=(count, 3))
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    if cosine:
        direction = direction - 1.000001 * outward
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    facing = np.sum(direction * outward, axis=1, keepdims=True)
    direction = np.where(facing > 0, -direction, direction)
    origin = np.asarray(sphere.center) + sphere.radius * 1.0001 * outward
    return origin.astype(np.float32), direction.astype(np.float32)


def visible_part(
    positions: Float, triangles: NDArray[np.uint32], rays: int, rng: np.random.Generator
) -> ExitSurface:
    """Keep the triangles that rays from outside meet first, and their neighbours.

    Triangles without area and copies of others (same corners, either way round) are left out: a
    viewer meets one of the copies, but the light would be spread over all of them.

    Neighbours (triangles that share a vertex with a seen one) close the pinholes that a finite
    number of rays leaves.
    """
    triangles = _proper(positions, triangles)
    whole = ExitSurface(positions, triangles, np.zeros(len(triangles), bool))
    origin, direction = inward_rays(whole.sphere, rays, rng, cosine=True)
    hits = whole.intersect(origin, direction)
    front, back = (
        np.bincount(hits.triangle[side], minlength=len(triangles))
        for side in (hits.front, ~hits.front)
    )
    _, corner = np.unique(positions, axis=0, return_inverse=True)
    corner = corner.reshape(-1)
    touched = np.zeros(corner.max() + 1, bool)
    touched[corner[triangles[front + back > 0]]] = True
    keep = touched[corner[triangles]].any(1)
    facing_out = triangles.copy()
    facing_out[back > front] = facing_out[back > front][:, ::-1]
    # A closed mesh shows its back only through rounding at edges; a sheet shows it often
    two_sided = np.minimum(front, back) > 0.02 * (front + back)
    used, compact = np.unique(facing_out[keep], return_inverse=True)
    return ExitSurface(positions[used], compact.reshape(-1, 3).astype(np.uint32), two_sided[keep])


def _proper(positions: Float, triangles: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The triangles that have an area, each once.

    Raises:
        PureLightError: there are none.
    """
    a, b, c = positions.astype(np.float64)[triangles.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    edge = np.maximum(((b - a) ** 2).sum(1), ((c - a) ** 2).sum(1))
    solid = triangles[area > 1e-9 * edge]
    if not len(solid):
        raise PureLightError("the lamp's shapes have no area; give it a surface to be seen")
    _, corner = np.unique(positions, axis=0, return_inverse=True)
    _, first = np.unique(np.sort(corner.reshape(-1)[solid], 1), axis=0, return_index=True)
    return solid[np.sort(first)]
