"""The training run: one route to the student, then the networks that are made from it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_train.learning.cap_samples import CapSamples
from purelight_train.learning.teacher import Teacher
from purelight_train.learning.training_sets import SamplerBatches, SurfaceSet, throughput_set
from purelight_train.light.luminaire import scene_digest
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Preset
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
    def throughput(self) -> SurfaceSet:
        """Lines through the lamp and what comes through: what the transparency learns."""
        samples, rng = self.preset.transparency_samples, self.stages.rng("transparency")
        return throughput_set(self.lamp.luminaire, samples, rng, self.stages.seed + 5)

    @cached_property
    def transparency(self) -> Transparency | None:
        """None for a lamp that no light passes straight: its bundle goes without."""
        finished = self.stages.run.finished("transparency")
        if not finished and not self.throughput[-1].any():
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
    def sampler(self) -> Sampler:
        network = self.stages.build("sampler", Sampler, self.lamp.description, self.preset)
        self.stages.train("sampler", network, self._sampler_loss, self.preset.sampler)
        return network

    @cached_property
    def fast_map(self) -> FastMap:
        network = self.stages.build("fast_map", FastMap, self.lamp.description, self.preset)

        def close_power() -> None:
            samples = self.cap_samples
            network.close_power(*self.stages.tensors(samples.point, samples.radiance))

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
            **fidelity(radiance, self.lamp.surface, self.lamp.held_out, self.stages.rng("metrics")),
            **self.stages.metrics(),
        }

    # Losses; their data is made at the first step

    def _transparency_loss(self, transparency: Transparency) -> Loss:
        data, size = self.stages.tensors(*self.throughput), self.preset.transparency.batch
        return lambda rng: transparency.loss(*rows(data, rng, size))

    def _sampler_loss(self, sampler: Sampler) -> Loss:
        batches, size = SamplerBatches(self.cap_samples), self.preset.sampler.batch
        tensors = self.stages.tensors
        return lambda rng: -sampler.log_density(*tensors(*batches.draw(rng, size))).mean()

    def _fast_map_loss(self, fast_map: FastMap) -> Loss:
        data = self.stages.tensors(self.cap_samples.point, self.cap_samples.radiance)
        return lambda rng: fast_map.loss(*rows(data, rng, self.preset.fast_map.batch))


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
    anchor: bool = False,
    early_stop: bool = False,
) -> Training:
    """Prepare a run directory for a luminaire, or continue one.

    Arguments:
        route: one of `routes.ROUTES`.
        anchor: whether the student encodes the ray's anchor (`surface_network`).
        early_stop: end optimisations whose error on held-out light has stopped falling.

    Raises:
        PureLightError: the directory holds another run, or a run and `resume` is not set.
    """
    run, preset = RunDirectory(output), preset.for_route(route, anchor=anchor)
    if not scene.is_file():
        raise PureLightError(f"{scene}: no such file; give a Mitsuba 3 scene (.xml) of a lamp")
    config = {
        "format": 1,
        "luminaire": str(scene.resolve()),
        "digest": scene_digest(scene),
        "route": route,
        "seed": seed,
        "preset": preset.to_dict(),
    }
    known = (output / "config.json").is_file()
    if known:
        _require_same(run, config, resume=resume)
    stages = Stages(run, seed, torch.device(device), ROUTES[route].names, early_stop)
    training = Training(ROUTES[route](TracedLamp(scene, preset.paths, stages), preset, stages))
    if not known:
        training.lamp.description  # noqa: B018 - a faulty or dark lamp must leave nothing behind
        output.mkdir(parents=True, exist_ok=True)
        run.write_json("config.json", config)
    return training


def reopen(run: RunDirectory, scene: Path, device: str = "cpu") -> Training:
    """A run as it was started, to look at what it made or to use it further."""
    config, preset = run.config, run.preset
    kind = ROUTES[config["route"]]
    stages = Stages(run, config["seed"], torch.device(device), kind.names)
    return Training(kind(TracedLamp(scene, preset.paths, stages), preset, stages))


def _require_same(run: RunDirectory, config: dict[str, Any], *, resume: bool) -> None:
    if not resume:
        raise PureLightError(f"{run.path}: holds a run already; add --resume or choose another")
    old = run.config
    changed = [k for k in ("digest", "seed", "route", "preset") if old.get(k) != config[k]]
    if changed:
        raise PureLightError(
            f"{run.path}: was made with another {changed[0]}; choose another --output"
        )
