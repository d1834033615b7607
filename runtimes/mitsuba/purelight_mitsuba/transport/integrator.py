"""The integrator plugin `purelight`: a path tracer that sees PureLight's lamps."""

from __future__ import annotations

import warnings
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_mitsuba.transport.film_passes import accumulate, sample_counts
from purelight_mitsuba.transport.paths import Limits, PathTracer
from purelight_mitsuba.transport.scene_parts import SceneParts, Settings, prepare

MODES = ("accurate", "fast")
ENGINES = ("auto", "fused", "queued")


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
        self.max_depth = 0xFFFFFFFF if depth == -1 else depth
        self.rr_depth = int(props.get("rr_depth", 5))
        if depth < -1 or self.rr_depth < 1:
            raise PureLightError("max_depth must be -1 or more, rr_depth 1 or more")
        self._parts: SceneParts | None = None
        self._per_pass = int(props.get("samples_per_pass", 0))
        self._named_early = False
        self._rendering = False  # By its own `render`, and not within another integrator
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
        self._refuse_recording()
        self._rendering = True
        try:
            return self._render(scene, sensor, seed, spp, develop, evaluate)
        finally:
            self._rendering = False

    def _render(
        self, scene: mi.Scene, sensor: mi.Sensor | int, seed: Any, spp: int, develop: bool,
        evaluate: bool,
    ) -> mi.TensorXf:  # fmt: skip
        before, engine = self.spoilt, self.prepare(scene).engine
        sensor = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
        usual = sensor.sampler().sample_count()
        pixels = int(np.prod(sensor.film().crop_size()))
        counts = sample_counts(spp or usual, engine.lanes // pixels, self._per_pass)
        if len(counts) == 1:
            image = super().render(scene, sensor, seed, spp, develop, evaluate)
        else:
            once = partial(self._render_once, scene, sensor)
            image = accumulate(once, sensor.film(), self.aov_names(), counts, seed)
            sensor.sampler().set_sample_count(spp or usual)
        self._warn(before)
        return image

    def _render_once(self, scene: mi.Scene, sensor: mi.Sensor, spp: int, seed: mi.UInt32) -> None:
        super().render(scene, sensor, seed, spp, False, True)

    def _warn(self, before: int) -> None:
        """Counts spoilt answers that the kernels met, and warns if there are more than before."""
        self.spoilt += int(self._spoilt.numpy()[0])
        self._spoilt = dr.zeros(mi.UInt32)
        if self.spoilt > before:
            warnings.warn(SpoiltWarning(self.spoilt), stacklevel=3)

    @staticmethod
    def _refuse_recording() -> None:
        """What is evaluated as a picture is drawn cannot be recorded, and Dr.Jit ends the process.

        Raises:
            PureLightError: If it is within a function that Dr.Jit freezes.
        """
        if dr.flag(dr.JitFlag.FreezingScope):
            raise PureLightError("purelight renders in no function that dr.freeze records")

    def _refuse_nesting(self) -> None:
        """A parent (`aov`) counts the layers when it is made, before any scene is known.

        With other layers later, Dr.Jit ends the process.

        Raises:
            PureLightError: If this integrator has light groups and is part of another.
        """
        if self.light_groups and self._named_early and not self._rendering:
            raise PureLightError(
                "light_groups does not work within another integrator; render without it, or use "
                "purelight-render --light-groups --aovs, which has both"
            )

    def aov_names(self) -> list[str]:
        self._named_early |= self._parts is None
        groups = self._parts.groups if self._parts else []
        return [f"light.{name}.{channel}" for name in groups for channel in "RGB"]

    def to_string(self) -> str:
        return f"PureLightIntegrator[{self.mode}]"

    def prepare(self, scene: mi.Scene) -> SceneParts:
        """Translates the networks and gathers the lamps that a scene needs, once.

        Raises:
            PureLightError: If a bundle lacks a network that the mode needs, or is not valid now.
        """
        return self._prepare(scene, self.engine)

    def _prepare(self, scene: mi.Scene, engine: str) -> SceneParts:
        settings = Settings(self.mode, engine, self.light_groups)
        self._parts = prepare(scene, settings, self._parts)
        return self._parts

    def sample(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.RayDifferential3f,
        medium: Any = None,
        active: mi.Bool = True,
    ) -> tuple[mi.Color3f, mi.Bool, list[mi.Float]]:
        self._refuse_nesting()
        # Within another integrator nobody bounds how many paths there are at a time
        nested = self.engine == "auto" and not self._rendering
        parts = self._prepare(scene, "fused" if nested else self.engine)
        active = active & (self.max_depth > 0)
        limits = Limits(self.max_depth, self.rr_depth, self.hide_emitters)
        # Dr.Jit would trace loops twice to find what stays the same in them, networks and all,
        # which LLVM finds as well.
        twice = dr.backend_v(mi.Float) == dr.JitBackend.CUDA
        with dr.scoped_set_flag(dr.JitFlag.OptimizeLoops, twice):
            path = PathTracer(scene, parts, limits, self)(ray, sampler, active)
        spoilt = path.light.spoilt
        dr.scatter_add(self._spoilt, spoilt, mi.UInt32(0), spoilt > 0)
        layers = [part[channel] for part in path.light.groups for channel in range(3)]
        return path.light.total, path.seen, layers
