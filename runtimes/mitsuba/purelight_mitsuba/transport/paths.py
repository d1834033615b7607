"""Paths of light from the camera, bounce by bounce."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.transport.engine import Aim
from purelight_mitsuba.transport.scene_parts import SceneParts
from purelight_mitsuba.transport.segment import NONE, Segment
from purelight_mitsuba.transport.state import Departure, Path, Vertex

LARGEST_SURVIVAL = 0.95


@dataclass(frozen=True)
class Limits:
    """How long paths are, and whether the camera sees Mitsuba's own emitters and the lamps."""

    max_depth: int
    rr_depth: int
    hide_emitters: bool


class PathTracer:
    """Follows paths through one scene.

    Arguments:
        integrator: Mitsuba's, which can look through its own emitters.
    """

    def __init__(
        self, scene: mi.Scene, parts: SceneParts, limits: Limits, integrator: mi.SamplingIntegrator
    ) -> None:
        self._scene, self._parts, self._limits = scene, parts, limits
        self._integrator = integrator

    def __call__(self, ray: mi.RayDifferential3f, sampler: mi.Sampler, active: mi.Bool) -> Path:
        """Follows paths from the camera to their end."""
        engine = self._parts.engine
        shadow_rays = [*self._parts.stock.none(), *engine.none()]
        path = Path.begin(ray, shadow_rays, len(self._parts.groups), active)
        if not self._limits.hide_emitters and self._scene.environment() is not None:
            path.seen = mi.Bool(active)
        return engine.follow(self._scene, self._bounce, path, sampler)

    def _bounce(self, path: Path, sampler: mi.Sampler, aim: Aim) -> Path:
        """Collects the light up to a path's next vertex, and sends out new rays from there."""
        scene, parts, limits = self._scene, self._parts, self._limits
        visible = path.active & ~(limits.hide_emitters & (path.depth == 0))

        # Find the room's next surface
        found = self._next(path)

        # What the lamps before it add, and let through; also on the last vertex's shadow rays
        length = dr.select(found.is_valid(), found.t, path.ray.maxt)  # A camera may clip
        left = path.departure
        view = Segment.of(
            path.ray, length, path.throughput, visible, own=left.own, skip=left.skip,
            shone=left.shone,
        )  # fmt: skip
        walked = parts.walk(view, path.departure, path.shadow_rays, sampler)
        path.light = path.light + walked.light
        path.throughput = path.throughput * walked.survived
        path.seen = path.seen | (dr.min(walked.survived) < 1)

        # The next vertex: there, or at a lamp
        for stop in walked.stops:
            found = dr.select(stop.active, stop.found, found)
        vertex = Vertex.of(path.ray, found, parts.lamps, path.active)
        si, valid = vertex.si, vertex.si.is_valid()

        # Light of an emitter that was hit
        path.light = path.light.add(parts.stock.hit(scene, si, path, visible))

        # Aim at an emitter
        onward = path.active & valid & (path.depth + 1 < limits.max_depth)
        smooth = onward & mi.has_flag(vertex.bsdf.flags(), mi.BSDFFlags.Smooth)
        to_emitter = parts.stock.aim(scene, vertex, path.throughput, sampler, smooth)

        # Aim at a lamp
        to_lamp = aim(path, vertex, sampler, smooth)
        path.shadow_rays = [*to_emitter, *to_lamp]

        # Go on
        within = self._within(walked.within, left.shone, si.p)
        return self._go_on(path, vertex, within, sampler, onward)

    def _within(self, met: mi.UInt32, before: mi.UInt32, p: mi.Point3f) -> mi.UInt32:
        """The lamp that has been met on a straight line, between whose parts a point lies, or NONE.

        Arguments:
            met, before: The lamp that was met last in whose sphere the line ended; on its last
                part, and on those before.
        """
        lamps = self._parts.lamps
        if lamps is None:
            return mi.UInt32(NONE)
        lamp = dr.select(met != NONE, met, before)
        known = lamp != NONE
        return dr.select(known & (lamps.place(lamp, known).radii(p) < 1), lamp, NONE)

    def _next(self, path: Path) -> mi.PreliminaryIntersection3f:
        """The room's next surface on the way of a path."""
        found = self._scene.ray_intersect_preliminary(path.ray, path.depth == 0, path.active)
        if self._limits.hide_emitters:
            first = path.active & (path.depth == 0)
            beyond = self._integrator.skip_area_emitters(self._scene, path.ray, True, first)
            found = dr.select(first, beyond, found)
        return found

    def _go_on(
        self, path: Path, vertex: Vertex, within: mi.UInt32, sampler: mi.Sampler, onward: mi.Bool
    ) -> Path:
        """Continues in a direction that the BSDF draws, or ends the path, also by roulette.

        Arguments:
            within: The lamp that has been met on this line, between whose parts the vertex is.
        """
        si = vertex.si
        drawn, weight = vertex.bsdf.sample(
            mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d(), onward
        )
        throughput, eta = path.throughput * weight, path.eta * drawn.eta
        depth = path.depth + dr.select(si.is_valid(), mi.UInt32(1), mi.UInt32(0))
        null = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Null)
        delta = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
        roulette = depth >= self._limits.rr_depth
        brightest = dr.max(throughput)
        chance = dr.minimum(brightest * dr.square(eta), LARGEST_SURVIVAL)
        survives = ~roulette | (sampler.next_1d() < chance)
        here = mi.Interaction3f(si.t, si.time, si.wavelengths, si.p, si.n)
        return Path(
            ray=si.spawn_ray(si.to_world(drawn.wo)),
            throughput=dr.select(roulette, throughput / chance, throughput),
            eta=eta,
            departure=Departure(
                here, drawn.pdf, delta, vertex.own, vertex.skip, dr.select(null, within, NONE)
            ),
            shadow_rays=path.shadow_rays,
            light=path.light,
            depth=depth,
            seen=path.seen | (path.active & si.is_valid() & ~null),
            active=onward & (brightest > 0) & survives,
        )
