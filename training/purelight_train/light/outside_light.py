"""Light from outside that meets a lamp whose emitters are off: what becomes of it.

By reciprocity, a path that begins where a viewer looks and ends in the surroundings is light that
comes from there to the viewer. Lines that are uniform over a surface see the lamp under an even
sky, and the mean of the paths' weights is its reflectance for even light.
"""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_surface import ExitSurface, cosine_directions
from purelight_train.light.look_back import LookBack
from purelight_train.light.media import Media
from purelight_train.light.rays import leave, scene_extent

MAX_EVENTS = 512  # surfaces and collisions with media together
ROULETTE_DEPTH = 16
Float = NDArray[np.float32]


@dataclass(frozen=True)
class Lines:
    """Lines of sight to points of an exit surface, as they would be under an even sky.

    Arguments:
        position, normal, outgoing: [N, 3] of the points; `outgoing` toward the viewer.
        triangle: [N] of each.
    """

    position: Float
    normal: Float
    outgoing: Float
    triangle: NDArray[np.int64]

    @staticmethod
    def to(surface: ExitSurface, triangles: NDArray[np.int64], count: int, seed: int) -> Lines:
        """Lines to some triangles, from before them."""
        rng = np.random.default_rng(seed)
        area = surface.triangle_area[triangles]
        chosen = triangles[rng.choice(len(triangles), count, p=area / area.sum())]
        normal = surface.outward_normals()[chosen].astype(np.float32)
        position = surface.points_of(chosen, rng.random((2, count)))
        return Lines(position, normal, cosine_directions(normal, rng), chosen)

    def origin(self, radius: float) -> Float:
        """Where viewers stand: just before the points."""
        start: Float = self.position + np.float32(1e-3 * radius) * self.outgoing
        return start

    @property
    def cosine(self) -> NDArray[np.float64]:
        """Of the angle to the normal: [N]."""
        result: NDArray[np.float64] = np.einsum("nd,nd->n", self.normal, self.outgoing)
        return result


@dataclass(frozen=True)
class Met:
    """What became of each line.

    Arguments:
        weight: [N, 3] of the light, when the path has left the lamp for good; 0 if it never does.
        ahead: [N] cosine of the direction it left in to the line.
        first: [N, 3] of the light, when it first left the exit surface, and `first_ahead`.
        mirrored: [N] whether the first event was a reflection.
    """

    weight: NDArray[np.float64]
    ahead: NDArray[np.float64]
    first: NDArray[np.float64]
    first_ahead: NDArray[np.float64]
    mirrored: NDArray[np.bool_]


class OutsideLight:
    """Follows light from outside through one lamp. Not a dataclass, see `light_tracing.Lamp`."""

    def __init__(self, scene: mi.Scene, surface: ExitSurface) -> None:
        self.scene, self._radius = scene, surface.sphere.radius
        self.extent = dr.opaque(mi.Float, scene_extent(scene))
        self.look_back = LookBack(surface, scene)
        self.media = Media(scene, scattering=True)

    def __call__(self, lines: Lines, seed: int) -> Met:
        """Follows one path for each line."""
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed, len(lines.position))
        origin, direction = (
            np.ascontiguousarray(a.T) for a in (lines.origin(self._radius), -lines.outgoing)
        )
        ray = mi.Ray3f(mi.Point3f(origin), mi.Vector3f(direction))
        end = _follow(self, ray, sampler)
        dr.eval(end)
        line = np.asarray(-lines.outgoing, np.float64)
        arrays = [
            np.array(a, np.float64).T for a in (end.weight, end.way, end.first, end.first_way)
        ]
        weight, way, first, first_way = arrays
        return Met(
            np.nan_to_num(weight), (way * line).sum(1), np.nan_to_num(first),
            (first_way * line).sum(1), np.array(end.mirrored),
        )  # fmt: skip


@dataclass
class _End:
    weight: mi.Color3f
    way: mi.Vector3f
    first: mi.Color3f
    first_way: mi.Vector3f
    left: mi.Bool
    mirrored: mi.Bool


@dr.syntax
def _follow(lamp: OutsideLight, ray: mi.Ray3f, sampler: mi.Sampler) -> _End:
    weight, medium = mi.Color3f(1), dr.zeros(mi.MediumPtr)
    nothing, nowhere = mi.Color3f(0), mi.Vector3f(ray.d)
    end = _End(nothing, nowhere, mi.Color3f(0), mi.Vector3f(ray.d), mi.Bool(False), mi.Bool(False))
    events, active, inside = mi.UInt32(0), mi.Bool(True), mi.Bool(False)
    while active:
        si = lamp.scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        flight = lamp.media.fly(medium, ray, si.t, weight, sampler, active)
        weight = dr.select(active, flight.weight, weight)
        free = active & ~si.is_valid() & ~flight.collided
        met = active & si.is_valid() & ~flight.collided
        # Has it left the exit surface, to meet another part of it?
        seen = lamp.look_back(ray.o, ray.d, 0.5 * si.t, met & inside)
        leaves = (free | seen) & ~end.left & (events > 0)
        end.first = dr.select(leaves, weight, end.first)
        end.first_way = dr.select(leaves, ray.d, end.first_way)
        end.left |= leaves
        end.weight = dr.select(free, weight, end.weight)
        end.way = dr.select(free, ray.d, end.way)
        # A surface
        bsdf, context = si.bsdf(ray), mi.BSDFContext(mi.TransportMode.Importance)
        drawn, value = bsdf.sample(context, si, sampler.next_1d(met), sampler.next_2d(met), met)
        onward = si.to_world(drawn.wo)
        back = dr.dot(si.n, onward) * dr.dot(si.n, -ray.d) > 0
        end.mirrored |= met & (events == 0) & back
        weight = dr.select(met, weight * value, weight)
        medium = lamp.media.behind(si, onward, medium, met)
        next_ray = leave(si.p, si.n, onward, lamp.extent)
        if dr.hint(lamp.media.present, mode="scalar"):
            event = lamp.media.scatter(medium, flight, sampler)
            weight = dr.select(flight.collided, event.weight, weight)
            next_ray = dr.select(
                flight.collided, mi.Ray3f(flight.interaction.p, event.direction), next_ray
            )
        inside = met
        active &= met | flight.collided
        active &= (dr.max(weight) > 0) & (events < MAX_EVENTS)
        ray = dr.select(active, next_ray, ray)
        roulette = active & (events > ROULETTE_DEPTH)
        chance = dr.clip(dr.max(weight), 0.05, 0.95)
        weight = dr.select(roulette, weight / chance, weight)
        active &= ~roulette | (sampler.next_1d(active) < chance)
        events += 1
    return end
