"""Mitsuba's own emitters: aiming at them, and hitting them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.transport.mis import power
from purelight_mitsuba.transport.segment import Segment
from purelight_mitsuba.transport.state import Path, Vertex


class StockEmitters:
    """The emitters of a scene that are not PureLight's; false if there is none.

    One whose sampling weight is zero is not aimed at, but may be hit.
    """

    def __init__(self, scene: mi.Scene) -> None:
        emitters = [e for e in scene.emitters() if not isinstance(e, PureLightEmitter)]
        weights = [float(e.sampling_weight()) for e in emitters]
        self._count, self._aims = len(emitters), sum(weights) > 0
        if self._aims:
            self._total = mi.Float(sum(weights))
            self._choice = mi.DiscreteDistribution(weights)
            self._pointers = mi.EmitterPtr(emitters)
            dr.make_opaque(self._total, self._pointers)

    def __bool__(self) -> bool:
        return self._count > 0

    def none(self) -> list[Segment]:
        """As many shadow rays as `aim` returns, none of them active."""
        return [Segment.none()] if self._aims else []

    def aim(
        self, scene: mi.Scene, vertex: Vertex, throughput: mi.Color3f, sampler: mi.Sampler,
        active: mi.Bool,
    ) -> list[Segment]:  # fmt: skip
        """Sends a shadow ray toward one of the emitters, clear of the room's surfaces."""
        if not self._aims:
            return []
        si = vertex.si
        index, chance = self._choice.sample_pmf(sampler.next_1d(), active)
        emitter = dr.gather(mi.EmitterPtr, self._pointers, index, active)
        ds, light = emitter.sample_direction(si, sampler.next_2d(), active)
        active = active & (ds.pdf > 0) & (chance > 0)
        # Mitsuba puts what is infinitely far on a sphere around its shapes, without the lamps, and
        # around none if all are rectangles; the ray then ended before what is in its way.
        far = mi.has_flag(emitter.flags(), mi.EmitterFlags.Infinite)
        ray = dr.select(far, si.spawn_ray(ds.d), si.spawn_ray_to(ds.p))
        active = active & ~scene.ray_test(ray, active)
        value, pdf = vertex.bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(ds.d), active)
        share = dr.select(ds.delta, 1, power(ds.pdf * chance, pdf)) / chance
        total = throughput * value * light * share
        ray = si.spawn_ray(ds.d)
        length = dr.select(far, dr.largest(mi.Float), ds.dist)
        useful = active & (dr.max(total) > 0)
        own, skip = vertex.own, vertex.skip
        return [Segment.of(ray, length, total, useful, open=True, own=own, skip=skip)]

    def hit(
        self, scene: mi.Scene, si: mi.SurfaceInteraction3f, path: Path, active: mi.Bool
    ) -> mi.Color3f:
        """Light of an emitter, or of the environment, that the path ran into."""
        if not self:
            return mi.Color3f(0)
        emitter, departure = si.emitter(scene), path.departure
        active = active & (emitter != None)  # noqa: E711 - lane by lane
        compete = active & ~departure.delta
        ds = mi.DirectionSample3f(scene, si, departure.vertex)
        pdf = mi.Float(0)
        if self._aims:
            pdf = emitter.pdf_direction(departure.vertex, ds, compete)
            pdf = pdf * emitter.sampling_weight() / self._total
        share = dr.select(compete, power(departure.pdf_solid_angle, pdf), 1)
        return dr.select(active, path.throughput * emitter.eval(si, active) * share, 0)
