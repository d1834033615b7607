"""Paths of light from the camera, vertex by vertex."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.transport.aimed import Numbers
from purelight_mitsuba.transport.light import Light
from purelight_mitsuba.transport.queued import Queue, ShadowRays, Waiting
from purelight_mitsuba.transport.scene_parts import SceneParts
from purelight_mitsuba.transport.walk import NONE, Segment, Vertex

LARGEST_SURVIVAL = 0.95
ROULETTE = 2.0  # Shadow rays toward lamps, per throughput; least cost times variance in a room.


@dataclass
class Path:
    """The state of one path per lane."""

    ray: mi.Ray3f
    throughput: mi.Color3f
    light: Light
    eta: mi.Float
    depth: mi.UInt32
    previous: mi.Interaction3f
    pdf: mi.Float
    delta: mi.Bool
    seen: mi.Bool
    spoilt: mi.UInt32
    slot: mi.UInt32
    active: mi.Bool

    @staticmethod
    def begin(ray: mi.RayDifferential3f, active: mi.Bool, groups: int) -> Path:
        """A path at the camera."""
        return Path(
            mi.Ray3f(ray), mi.Color3f(1), Light.dark(groups), mi.Float(1), mi.UInt32(0),
            dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True), mi.Bool(False), mi.UInt32(0),
            mi.UInt32(NONE), mi.Bool(active),
        )  # fmt: skip


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

    def __call__(self, path: Path, sampler: mi.Sampler) -> tuple[Path, int]:
        """Follows paths to their end.

        Returns:
            The paths, and how many answers to queued questions were spoilt.
        """
        if self._parts.later is not None:
            return self._queue(self._parts.later, path, sampler)
        path, *_ = self._trace(path, self._parts.stock.none(), sampler, None)
        return path, 0

    def _queue(self, later: ShadowRays, path: Path, sampler: mi.Sampler) -> tuple[Path, int]:
        """Traces paths as far as the queue goes, empties it, and goes on until all have ended."""
        queue, stock = Queue(dr.width(path.ray)), self._parts.stock.none()
        light, spoilt = Light.dark(len(self._parts.groups)), 0
        pending = path.active
        while dr.any(pending):
            path.slot = queue.open(path.active)
            path, stock, sampler = self._trace(path, stock, sampler, queue)
            pending = _any(path.active, *stock)
            sampler.schedule_state()
            dr.eval(path, stock, pending)
            found, bad = later(self._scene, queue, len(self._parts.groups))
            light, spoilt = light + found, spoilt + bad
        path.light = path.light + light
        return path, spoilt

    def _trace(
        self, path: Path, stock: list[Segment], sampler: mi.Sampler, queue: Queue | None
    ) -> tuple[Path, list[Segment], mi.Sampler]:
        """Follows paths to their end, or until there is no room in the queue."""
        at_once = self._parts.aimed if queue is None else None
        aimed = at_once.none() if at_once else []

        def going(path: Path, stock: list[Segment], aimed: list[Segment], _: Any) -> mi.Bool:
            active = _any(path.active, *stock, *aimed)
            return active if queue is None else active & queue.served(path.slot)

        def body(path: Path, stock: Any, aimed: Any, sampler: mi.Sampler) -> tuple[Any, ...]:
            return (*self._step(path, stock, aimed, sampler, queue), sampler)

        path, stock, _, sampler = dr.while_loop(
            (path, stock, aimed, sampler), going, body, label="PureLight paths"
        )
        return path, stock, sampler

    def _step(
        self,
        path: Path,
        stock: list[Segment],
        aimed: list[Segment],
        sampler: mi.Sampler,
        queue: Queue | None,
    ) -> tuple[Path, list[Segment], list[Segment]]:
        """Finds the next vertex, settles the segments before it, and sends out new ones."""
        scene, parts, hide = self._scene, self._parts, self._limits.hide_emitters
        found = self._intersect(path)
        si = found.compute_surface_interaction(path.ray, mi.RayFlags.All, path.active)
        if parts.walk is not None:
            length = dr.select(si.is_valid(), si.t, dr.largest(mi.Float))
            visible = path.active & ~(hide & (path.depth == 0))
            view = Segment.of(path.ray, length, path.throughput, visible)
            vertex = Vertex(path.previous.p, path.pdf, path.delta)
            light, through, spoilt = parts.walk(view, vertex, stock, aimed)
            path.throughput = path.throughput * through
            path.spoilt = path.spoilt + spoilt
            path.seen = path.seen | (visible & (dr.min(through) < 1))
        else:
            light = Light.dark(len(parts.groups))
            for segment in stock:
                light = light.add(dr.select(segment.active, segment.weight, 0))
        hit = parts.stock.hit(scene, si, path, hide)
        path.light = (path.light + light).add(hit)

        onward = path.active & si.is_valid() & (path.depth + 1 < self._limits.max_depth)
        bsdf, context = si.bsdf(path.ray), mi.BSDFContext()
        smooth = onward & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        stock = parts.stock.aim(scene, si, bsdf, path, sampler, smooth)
        if queue is not None:
            self._wait(path, found, sampler, queue, smooth)
        elif parts.aimed:
            aimed = parts.aimed.aim(scene, si, bsdf, path, Numbers.draw(sampler), smooth)
        drawn, weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), onward)
        path = self._advance(path, si, drawn, weight, sampler, onward)
        if queue is not None:
            path.slot = queue.reserve(path.slot, path.active)
        return path, stock, aimed

    def _wait(
        self,
        path: Path,
        found: mi.PreliminaryIntersection3f,
        sampler: mi.Sampler,
        queue: Queue,
        active: mi.Bool,
    ) -> None:
        """Leaves aiming at a lamp for later, by roulette where it would be worth little."""
        worth = dr.max(path.throughput) * dr.square(path.eta)
        chance = dr.minimum(worth * ROULETTE, 1)
        active = active & (sampler.next_1d() < chance)
        vertex = Waiting(
            path.ray.o, path.ray.d, found, path.throughput / chance, Numbers.draw(sampler),
            queue.lane, mi.UInt32(0),
        )  # fmt: skip
        path.slot = queue.push(vertex, path.slot, active)

    def _intersect(self, path: Path) -> mi.PreliminaryIntersection3f:
        found = self._scene.ray_intersect_preliminary(path.ray, path.depth == 0, path.active)
        if self._limits.hide_emitters:
            first = path.active & (path.depth == 0)
            beyond = self._integrator.skip_area_emitters(self._scene, path.ray, True, first)
            found = dr.select(first, beyond, found)
        return found

    def _advance(
        self,
        path: Path,
        si: mi.SurfaceInteraction3f,
        drawn: mi.BSDFSample3f,
        weight: mi.Color3f,
        sampler: mi.Sampler,
        onward: mi.Bool,
    ) -> Path:
        """Continues along the direction that the BSDF drew, or ends the path."""
        throughput = path.throughput * weight
        eta = path.eta * drawn.eta
        depth = path.depth + dr.select(si.is_valid(), mi.UInt32(1), mi.UInt32(0))
        null = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Null)
        roulette = depth >= self._limits.rr_depth
        brightest = dr.max(throughput)
        chance = dr.minimum(brightest * dr.square(eta), LARGEST_SURVIVAL)
        survives = ~roulette | (sampler.next_1d() < chance)
        return Path(
            ray=si.spawn_ray(si.to_world(drawn.wo)),
            throughput=dr.select(roulette, throughput / chance, throughput),
            light=path.light,
            eta=eta,
            depth=depth,
            previous=mi.Interaction3f(si.t, si.time, si.wavelengths, si.p, si.n),
            pdf=drawn.pdf,
            delta=mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta),
            seen=path.seen | (onward & ~null),
            spoilt=path.spoilt,
            slot=path.slot,
            active=onward & (brightest > 0) & survives,
        )


def _any(active: mi.Bool, *segments: Segment) -> mi.Bool:
    """Whether the path goes on or a shadow ray is still to be followed."""
    for segment in segments:
        active = active | segment.active
    return active
