"""The integrator plugin `purelight`: a path tracer that sees PureLight's lamps."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError
from purelight_mitsuba.aimed import AimedLamps, Numbers
from purelight_mitsuba.emitter import PureLightEmitter
from purelight_mitsuba.film_passes import accumulate, sample_counts
from purelight_mitsuba.lamps import Lamps
from purelight_mitsuba.light import Light, group_names
from purelight_mitsuba.queries import Queries
from purelight_mitsuba.queued import Queue, ShadowRays, Waiting
from purelight_mitsuba.stock import StockEmitters
from purelight_mitsuba.walk import NONE, Segment, Vertex, Walk

MODES = ("accurate", "fast")
ENGINES = ("auto", "fused", "queued")
LANES = 1 << 21  # Of one pass of the engine `queued`; about 200 bytes each.
LARGEST_SURVIVAL = 0.95
LEAST_QUEUED = 3000  # Multiply-adds per shadow ray, from where on waiting pays.
ROULETTE = 2.0  # Shadow rays toward lamps, per throughput; least cost times variance in a room.


class SpoiltWarning(UserWarning):
    """Networks gave answers that are infinite or no number."""


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


@dataclass
class SceneParts:
    """What an integrator prepares once per scene, and again when a lamp was changed."""

    key: tuple[Any, ...]
    stock: StockEmitters
    aimed: AimedLamps | None
    walk: Walk | None
    later: ShadowRays | None
    groups: list[str]


class PureLightIntegrator(mi.SamplingIntegrator):
    """Path tracing in two scenes: the room, and the lamps that its rays cross on their way.

    A lamp adds its radiance and attenuates what is behind it, without becoming a vertex. Each
    vertex aims shadow rays at a lamp and one at an emitter of Mitsuba's; multiple importance
    sampling joins both with the BSDF's own directions.

    Properties: `mode`: `accurate` (direction by the sampler, radiance by the appearance network)
    or `fast` (both by the radiance map; camera rays, mirrors and sharp reflections still see the
    appearance network); `engine`: `fused` evaluates networks where a path needs them, `queued` most
    of them in batches afterwards, `auto` chooses by the cost that bundles state; `max_depth`
    (default unlimited), `rr_depth` (default 5), `hide_emitters`; `light_groups` (default false)
    adds a layer for each lamp, or each group of lamps with the same `light_group`, and one for all
    of Mitsuba's emitters; their sum is the picture.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        if not mi.variant().endswith("_ad_rgb"):
            raise PureLightError(f"variant {mi.variant()} has no RGB; use llvm_ad_rgb")
        self.mode = str(props.get("mode", "accurate"))
        if self.mode not in MODES:
            raise PureLightError(f"mode {self.mode} is neither accurate nor fast")
        self.engine = str(props.get("engine", "auto"))
        if self.engine not in ENGINES:
            raise PureLightError(f"engine {self.engine} is none of {', '.join(ENGINES)}")
        self.light_groups = bool(props.get("light_groups", False))
        depth = int(props.get("max_depth", -1))
        self.max_depth = 0xFFFFFFFF if depth < 0 else depth
        self.rr_depth = int(props.get("rr_depth", 5))
        self._parts: SceneParts | None = None
        self.spoilt = 0
        self._spoilt = dr.zeros(mi.UInt32)

    def render(
        self,
        scene: mi.Scene,
        sensor: mi.Sensor | int = 0,
        seed: Any = 0,
        spp: int = 0,
        develop: bool = True,
        evaluate: bool = True,
    ) -> mi.TensorXf:
        queued = self.prepare(scene).later is not None
        sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
        usual = sensor.sampler().sample_count()
        pixels = int(np.prod(sensor.film().crop_size()))
        counts = sample_counts(spp or usual, LANES // pixels) if queued else [spp]
        if len(counts) == 1:
            image = super().render(scene, sensor, seed, spp, develop, evaluate)
        else:
            once = partial(self._render_once, scene, sensor)
            image = accumulate(once, sensor.film(), self.aov_names(), counts, seed)
            sensor.sampler().set_sample_count(spp or usual)
        count = int(self._spoilt.numpy()[0])
        if count:
            self.spoilt += count
            self._spoilt = dr.zeros(mi.UInt32)
            warnings.warn(self.spoilt_message(), SpoiltWarning, stacklevel=2)
        return image

    def _render_once(self, scene: mi.Scene, sensor: mi.Sensor, spp: int, seed: mi.UInt32) -> None:
        super().render(scene, sensor, seed, spp, False, True)

    def spoilt_message(self) -> str:
        return f"{self.spoilt} answers of networks were infinite or no number; they count as dark"

    def aov_names(self) -> list[str]:
        groups = self._parts.groups if self._parts else []
        return [f"light.{name}.{channel}" for name in groups for channel in "RGB"]

    def to_string(self) -> str:
        return f"PureLightIntegrator[{self.mode}]"

    def prepare(self, scene: mi.Scene) -> SceneParts:
        """Translates the networks and gathers the lamps that a scene needs, once.

        Raises:
            PureLightError: If a bundle lacks a network that the mode needs, or is not valid now.
        """
        emitters = [e for e in scene.emitters() if isinstance(e, PureLightEmitter)]
        for emitter in emitters:
            emitter.refresh()
        # The scene itself would keep this integrator, and so itself, alive for ever.
        key = (
            self.mode,
            self.engine,
            self.light_groups,
            *scene.emitters(),
            *((e.placement, e.level, e.luminaire, e.light_group) for e in emitters),
        )
        if self._parts is None or self._parts.key != key:
            groups = group_names(emitters) if self.light_groups else []
            self._parts = SceneParts(key, StockEmitters(scene), None, None, None, groups)
            if emitters:
                lamps = Lamps(emitters, scene, groups)
                queries = Queries(lamps, fast=self.mode == "fast")
                self._parts.aimed = AimedLamps(lamps, queries)
                self._parts.walk = Walk(lamps, queries)
                if self._queues(lamps):
                    later = ShadowRays(self._parts.aimed, self._parts.walk, lamps.luminaires)
                    self._parts.later = later
        return self._parts

    def _queues(self, lamps: Lamps) -> bool:
        """Whether shadow rays toward lamps wait in a queue."""
        if self.engine == "auto":
            names = ("fast_map",) if self.mode == "fast" else ("sampler", "appearance")
            costs = [sum(lamp.cost(name) for name in names) for lamp in lamps.luminaires]
            return max(costs) >= LEAST_QUEUED and not lamps.dark
        return self.engine == "queued" and not lamps.dark

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
            mi.Ray3f(ray), mi.Color3f(1), Light.dark(len(parts.groups)), mi.Float(1), mi.UInt32(0),
            dr.zeros(mi.Interaction3f), mi.Float(1), mi.Bool(True), mi.Bool(False), mi.UInt32(0),
            mi.UInt32(NONE), mi.Bool(active),
        )  # fmt: skip
        if parts.later is None:
            path, *_ = self._trace(scene, parts, path, parts.stock.none(), sampler, None)
        else:
            path = self._queue(scene, parts, parts.later, path, sampler)
        dr.scatter_add(self._spoilt, path.spoilt, mi.UInt32(0), path.spoilt > 0)
        layers = [part[channel] for part in path.light.groups for channel in range(3)]
        return path.light.total, path.seen, layers

    def _queue(
        self,
        scene: mi.Scene,
        parts: SceneParts,
        later: ShadowRays,
        path: Path,
        sampler: mi.Sampler,
    ) -> Path:
        """Traces paths as far as the queue goes, empties it, and goes on until all have ended."""
        queue, stock = Queue(dr.width(path.ray)), parts.stock.none()
        light = Light.dark(len(parts.groups))
        pending = path.active
        while dr.any(pending):
            path.slot = queue.open(path.active)
            path, stock, sampler = self._trace(scene, parts, path, stock, sampler, queue)
            pending = _any(path.active, *stock)
            sampler.schedule_state()
            dr.eval(path, stock, pending)
            found, spoilt = later(scene, queue, len(parts.groups))
            light = light + found
            dr.scatter_add(self._spoilt, mi.UInt32(spoilt), mi.UInt32(0))
        path.light = path.light + light
        return path

    def _trace(
        self,
        scene: mi.Scene,
        parts: SceneParts,
        path: Path,
        stock: list[Segment],
        sampler: mi.Sampler,
        queue: Queue | None,
    ) -> tuple[Path, list[Segment], mi.Sampler]:
        """Follows paths to their end, or until there is no room in the queue."""
        aimed = parts.aimed.none() if parts.aimed and queue is None else []

        def going(path: Path, stock: list[Segment], aimed: list[Segment], _: Any) -> mi.Bool:
            active = _any(path.active, *stock, *aimed)
            return active if queue is None else active & queue.served(path.slot)

        def body(path: Path, stock: Any, aimed: Any, sampler: mi.Sampler) -> tuple[Any, ...]:
            return (*self._step(scene, parts, path, stock, aimed, sampler, queue), sampler)

        path, stock, _, sampler = dr.while_loop(
            (path, stock, aimed, sampler), going, body, label="PureLight paths"
        )
        return path, stock, sampler

    def _step(
        self,
        scene: mi.Scene,
        parts: SceneParts,
        path: Path,
        stock: list[Segment],
        aimed: list[Segment],
        sampler: mi.Sampler,
        queue: Queue | None,
    ) -> tuple[Path, list[Segment], list[Segment]]:
        """Finds the next vertex, settles the segments before it, and sends out new ones."""
        found = self._intersect(scene, path)
        si = found.compute_surface_interaction(path.ray, mi.RayFlags.All, path.active)
        if parts.walk is not None:
            length = dr.select(si.is_valid(), si.t, dr.largest(mi.Float))
            visible = path.active & ~(self.hide_emitters & (path.depth == 0))
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
        hit = parts.stock.hit(scene, si, path, self.hide_emitters)
        path.light = (path.light + light).add(hit)

        onward = path.active & si.is_valid() & (path.depth + 1 < self.max_depth)
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

    def _intersect(self, scene: mi.Scene, path: Path) -> mi.PreliminaryIntersection3f:
        found = scene.ray_intersect_preliminary(path.ray, path.depth == 0, path.active)
        if self.hide_emitters:
            first = path.active & (path.depth == 0)
            beyond = self.skip_area_emitters(scene, path.ray, True, first)
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
            slot=path.slot,
            active=onward & (brightest > 0) & survives,
        )


def _any(active: mi.Bool, *segments: Segment) -> mi.Bool:
    """Whether the path goes on or a shadow ray is still to be followed."""
    for segment in segments:
        active = active | segment.active
    return active
