"""The training run: its stages in order, each resumable."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from tqdm import tqdm

from purelight_format.errors import PureLightError
from purelight_train import preview
from purelight_train.cap_samples import CapSamples
from purelight_train.description import Description
from purelight_train.exit_records import ExitRecords, settle
from purelight_train.exit_surface import inward_rays
from purelight_train.fast_map import FastMap
from purelight_train.flux_closure import surface_flux
from purelight_train.light_tracing import BATCH, trace_records
from purelight_train.luminaire import Luminaire, load_luminaire, scene_digest
from purelight_train.optimisation import Trace, optimise
from purelight_train.positional_density import PositionalDensity
from purelight_train.presets import Optimisation, Preset
from purelight_train.run_directory import RunDirectory
from purelight_train.sampler import Sampler
from purelight_train.student import Student
from purelight_train.teacher import DirectionalFlow, Teacher, TeacherBatches
from purelight_train.throughput import straight_throughput
from purelight_train.transparency import Transparency

Float = NDArray[np.float32]
Module = TypeVar("Module", bound=nn.Module)
STAGES = ("light", "teacher", "distillation", "student", "transparency", "cap", "sampler",
          "fast_map")  # fmt: skip
HELD_OUT = 1 << 17
ESCAPED = 1 << 19
FLUX_SAMPLES = 1 << 20
EVALUATION_BATCH = 1 << 15


@dataclass
class Training:
    """One training run of one luminaire into one run directory.

    Random numbers come from (seed, stage), so any stage can be repeated or resumed alone.
    """

    run: RunDirectory
    scene: Path
    preset: Preset
    seed: int
    device: torch.device
    seconds: dict[str, float] = field(default_factory=dict)
    traces: dict[str, Trace] = field(default_factory=dict)

    # Data, made when first needed

    @cached_property
    def luminaire(self) -> Luminaire:
        return load_luminaire(self.scene, self.seed)

    @cached_property
    def _traced(self) -> tuple[ExitRecords, NDArray[np.int64]]:
        paths = self.preset.paths
        with self._bar("light", -(-paths // BATCH) * BATCH, "path") as update:
            records = trace_records(self.luminaire.scene, paths, self.seed + 1, update)
        return settle(records, self.luminaire.exit_surface)

    @cached_property
    def held_out(self) -> ExitRecords:
        """Records that no network is trained on."""
        records = trace_records(self.luminaire.scene, BATCH, self.seed + 100_003)
        return settle(records, self.luminaire.exit_surface)[0].take(slice(HELD_OUT))

    @cached_property
    def description(self) -> Description:
        records, surface = self._traced[0], self.luminaire.exit_surface
        present = np.array(records.channels)
        scale = records.flux[present].mean() / (np.pi * surface.area)
        r, g, b = (float(f) for f in records.flux)
        er, eg, eb = (float(f) for f in records.flux_error)
        return Description(
            surface.sphere, (r, g, b), (er, eg, eb), float(scale), records.channels,
            surface.area, records.paths,
        )  # fmt: skip

    @cached_property
    def density(self) -> PositionalDensity:
        return PositionalDensity.build(
            self._traced[0], self.luminaire.exit_surface, self.preset.density_neighbours,
            self._rng("distillation", 1),
        )  # fmt: skip

    @cached_property
    def teacher(self) -> Teacher:
        flow = self._build("teacher", DirectionalFlow)
        self._train("teacher", flow, self._teacher_loss(flow), self.preset.teacher)
        return Teacher(self.description, self.luminaire.exit_surface, self.density, flow)

    @cached_property
    def student(self) -> Student:
        student = self._build("student", Student)
        self._train(
            "student",
            student,
            self._student_loss(student),
            self.preset.student,
            finish=lambda: self._close_flux(student),
        )
        return student

    @cached_property
    def cap_samples(self) -> CapSamples:
        student = self.radiance(self.student)
        with self._bar("cap", self.preset.cap_points, "point") as update:
            return CapSamples.gather(
                self.description, self.luminaire.exit_surface, student, self.preset.cap_points,
                self._rng("cap"), update,
            )  # fmt: skip

    # The run

    def __call__(self) -> dict[str, Any]:
        """Run every unfinished stage and write metrics and previews.

        Returns:
            the contents of metrics.json.
        """
        self._write_sources()
        student = self.student
        transparency = self._build("transparency", Transparency)
        self._train(
            "transparency", transparency, self._transparency_loss(transparency),
            self.preset.transparency,
        )  # fmt: skip
        sampler = self._build("sampler", Sampler)
        self._train("sampler", sampler, self._sampler_loss(sampler), self.preset.sampler)
        fast_map = self._build("fast_map", FastMap)
        self._train(
            "fast_map",
            fast_map,
            self._fast_map_loss(fast_map),
            self.preset.fast_map,
            finish=lambda: fast_map.close_power(
                *self._tensors(self.cap_samples.point, self.cap_samples.radiance)
            ),
        )
        metrics = self._metrics(student)
        self._previews(student, transparency)
        self.run.write_json("metrics.json", metrics)
        return metrics

    def _write_sources(self) -> None:
        """Store what the exporter needs of the lamp itself."""
        if (self.run.path / "escaped.npz").is_file():
            stored = self.run.description
            self.__dict__["description"] = stored
            return
        records, triangle = self._traced
        surface = self.luminaire.exit_surface
        flux = np.zeros((len(surface.triangles), 3))
        on = triangle >= 0
        np.add.at(flux, triangle[on], records.weight[on].astype(np.float64) / records.paths)
        self.run.write_json("description.json", self.description.to_dict())
        self.run.write_arrays(
            "surface.npz", positions=surface.positions, triangles=surface.triangles,
            triangle_flux=flux.astype(np.float32),
        )  # fmt: skip
        part = records.take(slice(ESCAPED))
        total = part.weight.sum(0, dtype=np.float64)
        scale = np.divide(records.flux, total, out=np.zeros(3), where=total > 0)
        self.run.write_arrays(
            "escaped.npz", direction=part.direction, weight=(part.weight * scale).astype(np.float32)
        )

    # Losses

    def _teacher_loss(self, flow: DirectionalFlow) -> Callable[[np.random.Generator], Tensor]:
        batches: list[TeacherBatches] = []

        def loss(rng: np.random.Generator) -> Tensor:
            if not batches:
                batches.append(TeacherBatches(self._traced[0], self.device))
            return -flow.log_pdf_projected(*batches[0].draw(rng, self.preset.teacher.batch)).mean()

        return loss

    def _student_loss(self, student: Student) -> Callable[[np.random.Generator], Tensor]:
        data: list[tuple[Tensor, ...]] = []

        def loss(rng: np.random.Generator) -> Tensor:
            if not data:
                data.append(self._tensors(*self._distillation_set()))
            index = rng.integers(0, len(data[0][0]), self.preset.student.batch)
            return student.loss(*(t[index] for t in data[0]))

        return loss

    def _distillation_set(self) -> tuple[Float, Float, Float, Float]:
        """Rays from outside and the teacher's radiance where they meet the lamp (Sec. 3.3)."""
        teacher, rng = self.teacher, self._rng("distillation")
        parts: list[tuple[Float, Float, Float, Float]] = []
        done, chunk = 0, 1 << 18
        with self._bar("distillation", self.preset.distillation_samples, "ray") as update:
            while done < self.preset.distillation_samples:
                origin, direction = inward_rays(
                    self.description.sphere, chunk, rng, cosine=bool(len(parts) % 2)
                )
                hits = self.luminaire.exit_surface.intersect(origin, direction)
                sample = (hits.position, hits.normal, -direction[hits.index])
                parts.append((*sample, teacher.radiance(*sample)))
                done += len(hits.index)
                update(done)
        stacked = [np.concatenate(column) for column in zip(*parts, strict=True)]
        return stacked[0], stacked[1], stacked[2], stacked[3]

    def _close_flux(self, student: Student) -> None:
        """Set the gain that makes the student's integral equal the light-traced flux."""
        flux, _ = surface_flux(
            self.luminaire.exit_surface, self.radiance(student), FLUX_SAMPLES,
            self._rng("student", 1),
        )  # fmt: skip
        target = np.asarray(self.description.flux)
        gain = np.divide(target, flux, out=np.ones(3), where=flux > 0)
        student.gain.copy_(torch.from_numpy(gain))

    def _transparency_loss(
        self, transparency: Transparency
    ) -> Callable[[np.random.Generator], Tensor]:
        data: list[tuple[Tensor, ...]] = []

        def loss(rng: np.random.Generator) -> Tensor:
            if not data:
                data.append(self._tensors(*self._throughput_set()))
            index = rng.integers(0, len(data[0][0]), self.preset.transparency.batch)
            return transparency.loss(*(t[index] for t in data[0]))

        return loss

    def _throughput_set(self) -> tuple[Float, Float, Float, Float]:
        """Lines through the lamp and a random straight-through throughput of each."""
        origin, direction = inward_rays(
            self.description.sphere, self.preset.transparency_samples, self._rng("transparency"),
            cosine=True,
        )  # fmt: skip
        hits = self.luminaire.exit_surface.intersect(origin, direction)
        origin, direction = origin[hits.index], direction[hits.index]
        value = straight_throughput(self.luminaire.scene, origin, direction, self.seed + 5)
        return hits.position, hits.normal, -direction, value

    def _sampler_loss(self, sampler: Sampler) -> Callable[[np.random.Generator], Tensor]:
        data: list[tuple[NDArray[np.float64], NDArray[np.int64]]] = []

        def loss(rng: np.random.Generator) -> Tensor:
            if not data:
                samples = self.cap_samples
                share = samples.luminance().astype(np.float64)
                lit = np.flatnonzero(share.sum(1) > 0)
                cumulative = np.cumsum(share[lit] / share[lit].sum(1, keepdims=True))
                data.append((cumulative, lit))
            cumulative, lit = data[0]
            u = rng.random(self.preset.sampler.batch) * cumulative[-1]
            index = np.minimum(np.searchsorted(cumulative, u), len(cumulative) - 1)
            cells = self.cap_samples.square.shape[1]
            point, cell = lit[index // cells], index % cells
            z, p = self._tensors(
                self.cap_samples.square[point, cell], self.cap_samples.point[point]
            )
            return -sampler.log_density(z, p).mean()

        return loss

    def _fast_map_loss(self, fast_map: FastMap) -> Callable[[np.random.Generator], Tensor]:
        def loss(rng: np.random.Generator) -> Tensor:
            samples = self.cap_samples
            index = rng.integers(0, len(samples.point), self.preset.fast_map.batch)
            return fast_map.loss(*self._tensors(samples.point[index], samples.radiance[index]))

        return loss

    # Results

    def radiance(self, student: nn.Module) -> Callable[[Float, Float, Float], Float]:
        """The student as a function of NumPy arrays."""

        @torch.no_grad()
        def evaluate(position: Float, normal: Float, outgoing: Float) -> Float:
            result = np.empty_like(position)
            for i in range(0, len(position), EVALUATION_BATCH):
                part = slice(i, i + EVALUATION_BATCH)
                tensors = self._tensors(position[part], normal[part], outgoing[part])
                result[part] = student(*tensors).cpu().numpy()
            return result

        return evaluate

    def _metrics(self, student: Student) -> dict[str, Any]:
        surface = self.luminaire.exit_surface
        flux, error = surface_flux(
            surface, self.radiance(student), FLUX_SAMPLES, self._rng("metrics")
        )
        held = self.held_out
        luminous = held.weight.sum(1, dtype=np.float64)
        value = self.radiance(student)(held.position, held.normal, held.direction)
        density = value.sum(1) / flux.sum() * (np.pi * surface.area)
        gain = np.average(np.log(np.maximum(density, 1e-6)), weights=luminous)
        return {
            "flux": list(self.description.flux),
            "flux_error": list(self.description.flux_error),
            "student_flux": flux.tolist(),
            "student_flux_error": error.tolist(),
            "flux_gain": student.gain.tolist(),
            "held_out_gain_nats": float(gain),
            "seconds": {k: round(v, 2) for k, v in self.seconds.items()},
            "losses": {k: t.losses for k, t in self.traces.items()},
            "skipped_steps": {k: t.skipped for k, t in self.traces.items()},
        }

    def _previews(self, student: Student, transparency: Transparency) -> None:
        surface, folder = self.luminaire.exit_surface, self.run.path / "previews"
        radiance = self.radiance(student)
        views = [preview.view(surface, radiance, 256, 35, e) for e in (10.0, -50.0)]
        preview.save_row(folder / "student.png", views)
        through = preview.view(surface, self.radiance(transparency), 256, 35, 10.0)
        preview.save_png(folder / "transparency.png", preview.tone_map(through, 1.0))
        if "teacher" in self.__dict__:
            picture = preview.view(surface, self.teacher.radiance, 256, 35, 10.0)
            preview.save_row(folder / "teacher_student.png", [picture, views[0]])

    # Helpers

    def _build(self, name: str, kind: Callable[[Description, Preset], Module]) -> Module:
        """A network with initial weights that depend on the seed and the stage only."""
        torch.manual_seed(self.seed * 1009 + STAGES.index(name))
        return kind(self.description, self.preset).to(self.device)

    def _train(
        self,
        name: str,
        module: nn.Module,
        loss: Callable[[np.random.Generator], Tensor],
        settings: Optimisation,
        finish: Callable[[], None] = lambda: None,
    ) -> None:
        """Optimise a network, or load it when an earlier run finished it."""
        if self.run.finished(name):
            self._load(name, module)
            return
        stage = STAGES.index(name)
        loss(np.random.default_rng([self.seed, stage]))
        start = time.monotonic()
        with self._bar(name, settings.steps, "step") as update:
            self.traces[name] = optimise(
                module, loss, settings, self.seed * 1009 + stage,
                self.run.path / "checkpoints" / f"{name}.safetensors", update,
            )  # fmt: skip
        finish()
        self.seconds[name] = time.monotonic() - start
        self.run.save(name, module)

    def _load(self, name: str, module: nn.Module) -> None:
        self.run.load(name, module)
        module.to(self.device)

    def _bar(self, name: str, total: int, unit: str) -> Bar:
        title = f"[{STAGES.index(name) + 1}/{len(STAGES)}] {name}"
        return Bar(title, total, unit, lambda s: self.seconds.setdefault(name, s))

    def _rng(self, stage: str, part: int = 0) -> np.random.Generator:
        key = STAGES.index(stage) if stage in STAGES else len(STAGES)
        return np.random.default_rng([self.seed, key, part])

    def _tensors(self, *arrays: Float) -> tuple[Tensor, ...]:
        return tuple(torch.from_numpy(a).to(self.device) for a in arrays)


class Bar:
    """A progress bar that also takes the stage's time; called with the amount done."""

    def __init__(self, title: str, total: int, unit: str, finished: Callable[[float], Any]) -> None:
        self.bar = tqdm(
            total=total, desc=f"{title:<22}", unit=unit, unit_scale=True, file=sys.stderr,
            mininterval=0.5, dynamic_ncols=True,
        )  # fmt: skip
        self.finished, self.start = finished, time.monotonic()

    def __enter__(self) -> Bar:
        return self

    def __call__(self, done: int, loss: float | None = None) -> None:
        if loss is not None:
            self.bar.set_postfix_str(f"loss {loss:.4g}", refresh=False)
        self.bar.update(min(done, self.bar.total) - self.bar.n)

    def __exit__(self, *_: object) -> None:
        self.bar.close()
        self.finished(time.monotonic() - self.start)


def start(
    scene: Path, output: Path, preset: Preset, seed: int, device: str, *, resume: bool
) -> Training:
    """Prepare a run directory for a luminaire, or continue one.

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
        "route": "teacher",
        "seed": seed,
        "preset": preset.to_dict(),
    }
    if (output / "config.json").is_file():
        if not resume:
            raise PureLightError(f"{output}: holds a run already; add --resume or choose another")
        old = run.config
        changed = [k for k in ("digest", "seed", "preset") if old.get(k) != config[k]]
        if changed:
            raise PureLightError(
                f"{output}: was made with another {changed[0]}; choose another --output"
            )
    training = Training(run, scene, preset, seed, torch.device(device))
    if not (output / "config.json").is_file():
        training.description  # noqa: B018 - a faulty or dark lamp must leave nothing behind
        output.mkdir(parents=True, exist_ok=True)
        run.write_json("config.json", config)
    return training
