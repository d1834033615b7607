"""The integrator plugin `purelight`: a path tracer that sees PureLight's lamps."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_format.errors import PureLightError
from purelight_mitsuba.cap import INSIDE
from purelight_mitsuba.emitter import PureLightEmitter
from purelight_mitsuba.lamps import Lamps, Place
from purelight_mitsuba.queries import Queries
from purelight_mitsuba.stock import StockEmitters
from purelight_mitsuba.walk import Segment, Vertex, Walk, power

MODES = ("accurate", "fast")
LARGEST_SURVIVAL = 0.95


class SpoiltWarning(UserWarning):
    """Networks gave answers that are infinite or no number."""


@dataclass
class Path:
    """The state of one path per lane."""

    ray: mi.Ray3f
    throughput: mi.Color3f
    light: mi.Color3f
    eta: mi.Float
    depth: mi.UInt32
    previous: mi.Interaction3f
    pdf: mi.Float
    delta: mi.Bool
    seen: mi.Bool
    spoilt: mi.UInt32
    active: mi.Bool


@dataclass
class SceneParts:
    """What an integrator prepares once per scene, and again when a lamp was changed."""

    key: tuple[Any, ...]
    lamps: Lamps | None
    queries: Queries | None
    walk: Walk | None
    stock: StockEmitters


class PureLightIntegrator(mi.SamplingIntegrator):
    """Path tracing in two scenes: the room, and the lamps that its rays cross on their way.

    A lamp adds its radiance and attenuates what is behind it, without becoming a vertex. Each
    vertex aims one shadow ray at a lamp and one at an emitter of Mitsuba's; multiple importance
    sampling joins both with the BSDF's own directions.

    Properties: `mode`: `accurate` (direction by the sampler, radiance by the appearance network)
    or `fast` (both by the radiance map; camera rays, mirrors and sharp reflections still see the
    appearance network); `max_depth` (default unlimited), `rr_depth` (default 5), `hide_emitters`.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        if not mi.variant().endswith("_ad_rgb"):
            raise PureLightError(f"variant {mi.variant()} has no RGB; use llvm_ad_rgb")
        self.mode = str(props.get("mode", "accurate"))
        if self.mode not in MODES:
            raise PureLightError(f"mode {self.mode} is neither accurate nor fast")
        depth = int(props.get("max_depth", -1))
        self.max_depth = 0xFFFFFFFF if depth < 0 else depth
        self.rr_depth = int(props.get("rr_depth", 5))
        self._parts: SceneParts | None = None
        self.spoilt = 0
        self._spoilt = dr.zeros(mi.UInt32)

    def render(self, scene: mi.Scene, *args: Any, **kwargs: Any) -> mi.TensorXf:
        self.prepare(scene)
        image = super().render(scene, *args, **kwargs)
        count = int(self._spoilt.numpy()[0])
        if count:
            self.spoilt += count
            self._spoilt = dr.zeros(mi.UInt32)
            warnings.warn(self.spoilt_message(), SpoiltWarning, stacklevel=2)
        return image

    def spoilt_message(self) -> str:
        return f"{self.spoilt} answers of networks were infinite or no number; they count as dark"

    def to_string(self) -> str:
        return f"PureLightIntegrator[{self.mode}]"

    def prepare(self, scene: mi.Scene) -> SceneParts:
        """Translates the networks and gathers the lamps that a scene needs, once.

        Raises:
            PureLightError: If a bundle lacks a network that the mode needs.
        """
        emitters = [e for e in scene.emitters() if isinstance(e, PureLightEmitter)]
        key = (scene, self.mode, *((e, e.placement, e.level) for e in emitters))
        if self._parts is None or self._parts.key != key:
            lamps = Lamps(emitters, scene) if emitters else None
            queries = Queries(lamps, fast=self.mode == "fast") if lamps else None
            walk = Walk(lamps, queries) if lamps and queries else None
            self._parts = SceneParts(key, lamps, queries, walk, StockEmitters(scene))
        return self._parts

    def sample(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.RayDifferential3f,
        medium: Any = None,
        active: mi.Bool = True,
    ) -> tuple[mi.Color3f, mi.Bool, list[mi.Float]]:
        parts = self.prepare(scene)
        path = Path(
            mi.Ray3f(ray), mi.Color3f(1), mi.Color3f(0), mi.Float(1), mi.UInt32(0),
            dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True), mi.Bool(False), mi.UInt32(0),
            mi.Bool(active),
        )  # fmt: skip
        state = (path, Segment.none(), Segment.none(), sampler)
        path, *_ = dr.while_loop(
            state,
            lambda path, stock, direct, _: path.active | stock.active | direct.active,
            lambda path, stock, direct, sampler: (
                *self._step(scene, parts, path, stock, direct, sampler),
                sampler,
            ),
            label="PureLight paths",
        )
        dr.scatter_add(self._spoilt, path.spoilt, mi.UInt32(0), path.spoilt > 0)
        return path.light, path.seen, []

    def _step(
        self,
        scene: mi.Scene,
        parts: SceneParts,
        path: Path,
        stock: Segment,
        direct: Segment,
        sampler: mi.Sampler,
    ) -> tuple[Path, Segment, Segment]:
        """Finds the next vertex, settles the segments before it, and sends out new ones."""
        si = self._intersect(scene, path)
        if parts.walk is not None and parts.lamps is not None:
            length = dr.select(si.is_valid(), si.t, dr.largest(mi.Float))
            visible = path.active & ~(self.hide_emitters & (path.depth == 0))
            view = Segment.of(path.ray, length, path.throughput, visible, 0)
            light, through, spoilt = parts.walk(
                view, Vertex(path.previous.p, path.pdf, path.delta),
                stock if parts.stock else None, None if parts.lamps.dark else direct,
            )  # fmt: skip
            path.light = path.light + light
            path.throughput = path.throughput * through
            path.spoilt = path.spoilt + spoilt
            path.seen = path.seen | (visible & (dr.min(through) < 1))
        elif parts.stock:
            path.light = path.light + dr.select(stock.active, stock.weight, 0)
        path.light = path.light + parts.stock.hit(scene, si, path, self.hide_emitters)

        onward = path.active & si.is_valid() & (path.depth + 1 < self.max_depth)
        bsdf, context = si.bsdf(path.ray), mi.BSDFContext()
        smooth = onward & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        stock = parts.stock.aim(scene, si, bsdf, path, sampler, smooth)
        direct = self._aim(scene, parts, si, bsdf, path, sampler, smooth)
        drawn, weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), onward)
        return self._advance(path, si, drawn, weight, sampler, onward), stock, direct

    def _intersect(self, scene: mi.Scene, path: Path) -> mi.SurfaceInteraction3f:
        si = scene.ray_intersect(path.ray, mi.RayFlags.All, path.depth == 0, path.active)
        if self.hide_emitters:
            first = path.active & (path.depth == 0)
            found = self.skip_area_emitters(scene, path.ray, True, first)
            beyond = found.compute_surface_interaction(path.ray, mi.RayFlags.All, first)
            si = dr.select(first, beyond, si)
        return si

    def _aim(
        self,
        scene: mi.Scene,
        parts: SceneParts,
        si: mi.SurfaceInteraction3f,
        bsdf: mi.BSDFPtr,
        path: Path,
        sampler: mi.Sampler,
        active: mi.Bool,
    ) -> Segment:
        """A shadow ray toward one of the lamps."""
        lamps, queries = parts.lamps, parts.queries
        if lamps is None or queries is None or lamps.dark:
            return Segment.none()
        lamp, chance = lamps.pick(sampler.next_1d(), active)
        place = lamps.place(lamp, active)
        active = active & (dr.norm(place.centre - si.p) > place.radius * INSIDE)
        u = sampler.next_2d()
        if queries.fast:
            toward, pdf, weight, spoilt = queries.sample_map(place, si.p, u, active)
        else:
            toward, pdf, spoilt = queries.sample(place, si.p, u, active)
            weight = mi.Color3f(dr.select(pdf > 0, 1 / pdf, 0))
        path.spoilt = path.spoilt + spoilt
        active = active & (pdf > 0)
        value, pdf_bsdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(toward), active)
        share = power(pdf * chance, pdf_bsdf)
        active = active & (dr.max(value * weight) > 0)
        ray = si.spawn_ray(toward)
        length, free = self._reach(scene, place, ray, queries.fast, active)
        total = path.throughput * value * weight * (share / chance)
        return Segment.of(ray, length, total, free, lamp)

    @staticmethod
    def _reach(
        scene: mi.Scene, place: Place, ray: mi.Ray3f, fast: bool, active: mi.Bool
    ) -> tuple[mi.Float, mi.Bool]:
        """How far a shadow ray goes in the room, and whether that may reach the lamp's sphere."""
        along = dr.dot(place.centre - ray.o, ray.d)
        off_axis = dr.squared_norm(dr.fma(ray.d, -along, place.centre - ray.o))
        half = dr.safe_sqrt(dr.square(place.radius) - off_axis)
        limited = mi.Ray3f(ray)
        if fast:
            limited.maxt = along - half
            return limited.maxt, active & ~scene.ray_test(limited, active)
        limited.maxt = (along + half) * (1 + mi.math.RayEpsilon)
        found = scene.ray_intersect_preliminary(limited, active=active)
        return dr.select(found.is_valid(), found.t, limited.maxt), active

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
        roulette = depth >= self.rr_depth
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
            active=onward & (brightest > 0) & survives,
        )
