"""The training run: one route to the student, then the networks that are made from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_format.errors import PureLightError
from purelight_train.learning.aimed_samples import aimed_samples, cell_means
from purelight_train.learning.cap_samples import CapSamples
from purelight_train.learning.teacher import Teacher
from purelight_train.learning.training_sets import SamplerBatches, SurfaceSet, transmittance_set
from purelight_train.light.luminaire import scene_digest
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Preset
from purelight_train.runs.anchor_choice import choose_anchor
from purelight_train.runs.evaluation import as_function, fidelity, write_previews
from purelight_train.runs.routes import ROUTES, Route, TeacherRoute
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import Loss, Stages, rows
from purelight_train.runs.traced_lamp import TracedLamp

Float = NDArray[np.float32]


@dataclass
class Training:
    """One training run of one luminaire into one run directory."""

    route: Route

    @property
    def lamp(self) -> TracedLamp:
        return self.route.lamp

    @property
    def stages(self) -> Stages:
        return self.route.stages

    @property
    def preset(self) -> Preset:
        return self.route.preset

    @property
    def teacher(self) -> Teacher | None:
        """The teacher, on the route that has one."""
        return self.route.teacher if isinstance(self.route, TeacherRoute) else None

    @cached_property
    def student(self) -> Student:
        return self.route.student()

    @cached_property
    def see_through(self) -> SurfaceSet:
        """Lines through the lamp and what comes through: what the transparency learns."""
        samples, rng = self.preset.transparency_samples, self.stages.rng("transparency")
        return transmittance_set(self.lamp.luminaire, samples, rng, self.stages.seed + 5)

    @cached_property
    def transparency(self) -> Transparency | None:
        """None for a lamp that no light passes straight: its bundle goes without."""
        finished = self.stages.run.finished("transparency")
        if not finished and not self.see_through[-1].any():
            return None
        network = self.stages.build(
            "transparency", Transparency, self.lamp.description, self.preset
        )
        self.stages.train(
            "transparency", network, self._transparency_loss, self.preset.transparency
        )
        return network

    @cached_property
    def cap_samples(self) -> CapSamples:
        student = as_function(self.student, self.stages.device)
        with self.stages.bar("cap", self.preset.cap_points, "point") as update:
            return CapSamples.gather(
                self.lamp.description, self.lamp.surface, student, self.preset.cap_points,
                self.stages.rng("cap"), update,
            )  # fmt: skip

    @cached_property
    def pilot(self) -> Sampler:
        """A sampler that knows the lamp by even samples alone, and shows where to look again."""
        return self._trained_sampler("pilot", lambda: self.cap_samples)

    @cached_property
    def aimed_samples(self) -> CapSamples:
        student, lamp = as_function(self.student, self.stages.device), self.lamp
        with self.stages.bar("aim", self.preset.cap_points, "point") as update:
            return aimed_samples(
                self.cap_samples, self.pilot, lamp.description, lamp.surface, student,
                self.stages.rng("aim"), update,
            )  # fmt: skip

    @cached_property
    def sampler(self) -> Sampler:
        return self._trained_sampler("sampler", lambda: self.aimed_samples)

    def _trained_sampler(self, name: str, samples: Callable[[], CapSamples]) -> Sampler:
        """The pilot, or what goes on from it: each takes half of the steps."""
        network = self.stages.build(name, Sampler, self.lamp.description, self.preset)
        if name != "pilot" and not self.stages.run.finished(name):
            network.load_state_dict(self.pilot.state_dict())
        settings = self.preset.sampler
        half = replace(settings, steps=settings.steps // 2)
        self.stages.train(name, network, lambda s: self._sampler_loss(s, samples()), half)
        return network

    @cached_property
    def fast_map(self) -> FastMap:
        network = self.stages.build("fast_map", FastMap, self.lamp.description, self.preset)

        def close_power() -> None:
            network.close_power(*self._cells)

        self.stages.train(
            "fast_map", network, self._fast_map_loss, self.preset.fast_map, close_power
        )
        return network

    def __call__(self) -> dict[str, Any]:
        """Run every unfinished stage and write metrics and previews.

        Returns:
            the contents of metrics.json.
        """
        self.lamp.store()
        student, transparency = self.student, self.transparency
        self.sampler, self.fast_map  # noqa: B018 - trained and stored when first named
        metrics = self._metrics()
        device = self.stages.device
        write_previews(
            self.stages.run,
            self.lamp.surface,
            as_function(student, device),
            opaque if transparency is None else as_function(transparency, device),
            self.route.teacher_radiance,
        )
        self.stages.run.write_json("metrics.json", metrics)
        return metrics

    def _metrics(self) -> dict[str, Any]:
        """Contents of metrics.json: flux, fidelity, and each stage's time and losses."""
        radiance = as_function(self.student, self.stages.device)
        return {
            "flux": list(self.lamp.description.flux),
            "flux_error": list(self.lamp.description.flux_error),
            "dropped": self.lamp.description.dropped,
            "flux_gain": self.student.gain.tolist(),
            **fidelity(radiance, self.lamp, self.stages.rng("metrics")),
            **self.stages.metrics(),
        }

    # Losses; their data is made at the first step

    def _transparency_loss(self, transparency: Transparency) -> Loss:
        data, size = self.stages.tensors(*self.see_through), self.preset.transparency.batch
        return lambda rng: transparency.loss(*rows(data, rng, size))

    def _sampler_loss(self, sampler: Sampler, samples: CapSamples) -> Loss:
        batches, size = SamplerBatches(samples), self.preset.sampler.batch
        tensors = self.stages.tensors
        return lambda rng: -sampler.log_density(*tensors(*batches.draw(rng, size))).mean()

    @cached_property
    def _cells(self) -> tuple[Tensor, ...]:
        """Points and the mean radiance in the cells of their caps."""
        return self.stages.tensors(self.aimed_samples.point, cell_means(self.aimed_samples))

    def _fast_map_loss(self, fast_map: FastMap) -> Loss:
        data, size = self._cells, self.preset.fast_map.batch
        return lambda rng: fast_map.loss(*rows(data, rng, size))


def opaque(position: Float, normal: Float, outgoing: Float) -> Float:
    """Transmittance of a lamp that no light passes: [N, 3] of zeros."""
    return np.zeros_like(position)


def start(
    scene: Path,
    output: Path,
    preset: Preset,
    seed: int,
    device: str,
    *,
    resume: bool,
    route: str = "teacher",
    anchor: str = "none",
    early_stop: bool = False,
) -> Training:
    """Prepare a run directory for a luminaire, or continue one.

    Arguments:
        preset: of no route yet.
        route: one of `routes.ROUTES`.
        anchor: which anchors of a ray the student encodes, one of `presets.ANCHORS`, or `auto` to
            try them out on the lamp (`anchor_choice`).
        early_stop: end optimisations whose error on held-out light has stopped falling.

    Raises:
        PureLightError: the directory holds another run, or a run and `resume` is not set.
    """
    run = RunDirectory(output)
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; give a Mitsuba 3 scene (.xml) of a lamp")
    config = {
        "format": 1,
        "luminaire": str(scene.resolve()),
        "digest": scene_digest(scene),
        "route": route,
        "anchor": anchor,
        "seed": seed,
    }
    stages = Stages(run, seed, torch.device(device), ROUTES[route].names, early_stop)
    if (output / "config.json").is_file():
        return _continue(scene, stages, config, preset, resume=resume)
    lamp = TracedLamp(scene, preset.for_route(route).paths, stages)
    lamp.description  # noqa: B018 - a faulty or dark lamp must leave nothing behind
    if anchor == "auto":
        anchor, tried = choose_anchor(lamp, preset)
        config["tried_anchors"] = tried
    chosen = preset.for_route(route, anchor=anchor)
    output.mkdir(parents=True, exist_ok=True)
    run.write_json("config.json", config | {"preset": chosen.to_dict()})
    return Training(ROUTES[route](lamp, chosen, stages))


def _continue(
    scene: Path, stages: Stages, config: dict[str, Any], preset: Preset, *, resume: bool
) -> Training:
    """Go on with a run that was begun in the same way."""
    run, route = stages.run, config["route"]
    if not resume:
        raise PureLightError(f"{run.path}: holds a run already; add --resume or choose another")
    old = run.config
    anchor = run.preset.anchor if config["anchor"] == "auto" else config["anchor"]
    chosen = preset.for_route(route, anchor=anchor)
    asked = config | {"preset": chosen.to_dict()}
    keys = ("digest", "seed", "route", "anchor", "preset")
    changed = [key for key in keys if old.get(key) != asked[key]]
    if changed:
        raise PureLightError(
            f"{run.path}: was made with another {changed[0]}; choose another --output"
        )
    return Training(ROUTES[route](TracedLamp(scene, chosen.paths, stages), chosen, stages))


def reopen(run: RunDirectory, scene: Path, device: str = "cpu") -> Training:
    """A run as it was started, to look at what it made or to use it further."""
    config, preset = run.config, run.preset
    kind = ROUTES[config["route"]]
    stages = Stages(run, config["seed"], torch.device(device), kind.names)
    return Training(kind(TracedLamp(scene, preset.paths, stages), preset, stages))
