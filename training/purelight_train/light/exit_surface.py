"""The exit surface: the triangles of a luminaire that can be seen from outside it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere

Float = NDArray[np.float32]
RAY_BATCH = 1 << 20
NEAR = 1e-2  # of the sphere's radius: how far analytic shapes are from their triangles, at most
CONCAVITY_RAYS, CONVEX = 1 << 16, 1e-4


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


def mitsuba_mesh(positions: Float, triangles: NDArray[np.uint32]) -> mi.Mesh:
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
        vertex_normals: [V, 3] unit normals of the scene's own shading, zero where it is flat;
            flat everywhere if None.
        virtual: [T] mere places that light passes straight, where measured rays come from; none
            if None.
        source: [T] which of the triangles it was made from each is; None if nobody asks.
        turned: [T] whether their winding is the other way round there.
    """

    positions: Float
    triangles: NDArray[np.uint32]
    two_sided: NDArray[np.bool_]
    vertex_normals: Float | None = None
    virtual: NDArray[np.bool_] | None = None
    source: NDArray[np.int64] | None = None
    turned: NDArray[np.bool_] | None = None

    @cached_property
    def sphere(self) -> BoundingSphere:
        return bounding_sphere(self.positions)

    @cached_property
    def scene(self) -> mi.Scene:
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

    @cached_property
    def concave(self) -> bool:
        """Whether light that leaves it may meet it again."""
        position, normal = self.sample(CONCAVITY_RAYS, np.random.default_rng(0))
        direction = cosine_directions(normal, np.random.default_rng(1))
        lift = 1e-4 * self.sphere.radius * normal
        return bool(self.blocked(position + lift, direction).mean() > CONVEX)

    def outward_normals(self) -> NDArray[np.float64]:
        """Unit normals of the triangles on the side seen from outside: [T, 3]."""
        length = np.linalg.norm(self._cross, axis=1, keepdims=True)
        result: NDArray[np.float64] = self._cross / np.maximum(length, 1e-300)
        return result

    def sample(self, count: int, rng: np.random.Generator) -> tuple[Float, Float]:
        """Points uniform by area and their unit normals: two arrays [count, 3]."""
        weight = self.triangle_area / self.triangle_area.sum()
        chosen = rng.choice(len(weight), size=count, p=weight)
        return self._points(chosen, rng.random((2, count)), rng)

    def sample_rays(self, count: int, rng: np.random.Generator) -> tuple[Float, Float, Float]:
        r"""Position, normal and outgoing direction, uniform by area and projected solid angle.

        The mean of a field f over them estimates
        :math:`\frac{1}{\pi A} \int\int f \cos\theta\,d\omega\,dA`, with A the area of both
        sides of sheets. Light that meets the lamp again is among them: three of [count, 3].
        """
        position, normal = self.sample(count, rng)
        return position, normal, cosine_directions(normal, rng)

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
        normal = self._cross[chosen] / np.linalg.norm(self._cross[chosen], axis=1, keepdims=True)
        normal[self.two_sided[chosen] & (rng.random(len(chosen)) < 0.5)] *= -1
        return self.points_of(chosen, square), normal.astype(np.float32)

    def points_of(self, triangle: NDArray[np.int64], square: NDArray[np.float64]) -> Float:
        """Points of triangles [N] from uniform numbers [2, N]: [N, 3]."""
        u, v = square
        root = np.sqrt(u)
        bary = np.stack((1 - root, root * (1 - v), root * v), 1)
        corner = self.positions[self.triangles[triangle]]
        return np.einsum("nk,nkd->nd", bary, corner).astype(np.float32)

    def square_of(self, position: Float, triangle: NDArray[np.int64]) -> NDArray[np.float64]:
        """Inverse of `points_of`: [N, 3] and [N] -> [2, N]."""
        first, second, third = self._barycentric(position, triangle).T
        rest = second + third
        return np.stack(((1 - first) ** 2, third / np.where(rest > 0, rest, 1)))

    def shading_normals(self, position: Float, normal: Float, triangle: NDArray[Any]) -> Float:
        """Normals of the scene's own shading frame, on the side of `normal`: [N, 3].

        Only the teacher uses them, to describe directions in a frame without jumps between facets
        (the paper's local shading frame). Assets, runtimes and students use geometric normals.

        Arguments:
            position, normal: [N, 3] points and geometric normals.
            triangle: [N] triangle of each point.
        """
        if self.vertex_normals is None:
            return normal
        corners = self.triangles[triangle]
        weight = self._barycentric(position, triangle)
        smooth = np.einsum("nk,nkd->nd", weight, self.vertex_normals[corners])
        length = np.linalg.norm(smooth, axis=1, keepdims=True)
        smooth *= np.sign(np.einsum("nd,nd->n", smooth, normal))[:, None]
        return np.where(length > 0.1, smooth / np.maximum(length, 0.1), normal).astype(np.float32)

    def _barycentric(self, position: Float, triangle: NDArray[Any]) -> NDArray[np.float64]:
        """Weights of the corners of triangles at points on them: [N, 3]."""
        a, b, c = np.moveaxis(self.positions[self.triangles[triangle]].astype(np.float64), 1, 0)
        cross = self._cross[triangle]
        square = np.maximum(np.einsum("nd,nd->n", cross, cross), 1e-300)
        at = position.astype(np.float64)
        v = np.einsum("nd,nd->n", np.cross(c - b, at - b), cross) / square
        w = np.einsum("nd,nd->n", np.cross(a - c, at - c), cross) / square
        return np.clip(np.stack((v, w, 1 - v - w), 1), 0, 1)

    def blocked(self, origin: Float, direction: Float) -> NDArray[np.bool_]:
        """Whether rays meet the surface, origins and unit directions [N, 3]: [N]."""
        parts = [np.zeros(0, bool)]
        for i in range(0, len(origin), RAY_BATCH):
            start, way = origin[i : i + RAY_BATCH].T, direction[i : i + RAY_BATCH].T
            ray = mi.Ray3f(mi.Point3f(start), mi.Vector3f(way))
            parts.append(np.array(self.scene.ray_test(ray, coherent=False)))
        return np.concatenate(parts)

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


def cosine_directions(normal: Float, rng: np.random.Generator) -> Float:
    """Unit directions about normals [N, 3] with pdf cos(theta)/pi per solid angle: [N, 3]."""
    direction = rng.normal(size=normal.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    direction += normal * 1.000001
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction.astype(np.float32)


def proper(positions: Float, triangles: NDArray[np.uint32]) -> NDArray[np.int64]:
    """Indices of the triangles that have an area, each once.

    Raises:
        PureLightError: there are none.
    """
    a, b, c = positions.astype(np.float64)[triangles.T]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    edge = np.maximum(((b - a) ** 2).sum(1), ((c - a) ** 2).sum(1))
    solid = np.flatnonzero(area > 1e-9 * edge)
    if not len(solid):
        raise PureLightError("the lamp's shapes have no area; give it a surface to be seen")
    _, corner = np.unique(positions, axis=0, return_inverse=True)
    key = np.sort(corner.reshape(-1)[triangles[solid]], 1)
    _, first = np.unique(key, axis=0, return_index=True)
    result: NDArray[np.int64] = solid[np.sort(first)]
    return result
