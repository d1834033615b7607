"""The training run: its stages in order, each resumable."""

from __future__ import annotations

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

from purelight_format.errors import PureLightError
from purelight_train.cap_samples import CapSamples
from purelight_train.description import Description
from purelight_train.evaluation import as_function, close_flux, fidelity, write_previews
from purelight_train.exit_records import ExitRecords, escaped_part, settle, triangle_flux
from purelight_train.fast_map import FastMap
from purelight_train.light_tracing import BATCH, trace_records
from purelight_train.luminaire import Luminaire, load_luminaire, scene_digest
from purelight_train.optimisation import optimise
from purelight_train.positional_density import PositionalDensity
from purelight_train.presets import Optimisation, Preset
from purelight_train.progress import Bar
from purelight_train.run_directory import RunDirectory
from purelight_train.sampler import Sampler
from purelight_train.student import Student
from purelight_train.teacher import DirectionalFlow, Teacher, TeacherBatches
from purelight_train.training_sets import SamplerBatches, distillation_set, throughput_set
from purelight_train.transparency import Transparency

Float = NDArray[np.float32]
Loss = Callable[[np.random.Generator], Tensor]
Module = TypeVar("Module", bound=nn.Module)
STAGES = (
    "light", "teacher", "distillation", "student", "transparency", "cap", "sampler", "fast_map",
)  # fmt: skip
HELD_OUT = 1 << 17
ESCAPED = 1 << 19


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
        return Description.of(self._traced[0], self.luminaire.exit_surface)

    @cached_property
    def density(self) -> PositionalDensity:
        return PositionalDensity.build(
            self._traced[0], self.luminaire.exit_surface, self.preset.density_neighbours,
            self._rng("distillation", 1),
        )  # fmt: skip

    @cached_property
    def teacher(self) -> Teacher:
        flow = self._build("teacher", DirectionalFlow)
        self._train("teacher", flow, self._teacher_loss, self.preset.teacher)
        return Teacher(self.description, self.luminaire.exit_surface, self.density, flow)

    @cached_property
    def student(self) -> Student:
        student = self._build("student", Student)
        self._train(
            "student",
            student,
            self._student_loss,
            self.preset.student,
            finish=lambda: close_flux(
                student,
                as_function(student, self.device),
                self.luminaire.exit_surface,
                self.description.flux,
                self._rng("student", 1),
            ),
        )
        return student

    @cached_property
    def cap_samples(self) -> CapSamples:
        student = as_function(self.student, self.device)
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
            "transparency", transparency, self._transparency_loss,
            self.preset.transparency,
        )  # fmt: skip
        sampler = self._build("sampler", Sampler)
        self._train("sampler", sampler, self._sampler_loss, self.preset.sampler)
        fast_map = self._build("fast_map", FastMap)
        self._train(
            "fast_map",
            fast_map,
            self._fast_map_loss,
            self.preset.fast_map,
            finish=lambda: fast_map.close_power(
                *self._tensors(self.cap_samples.point, self.cap_samples.radiance)
            ),
        )
        metrics = self._metrics(student)
        write_previews(
            self.run,
            self.luminaire.exit_surface,
            as_function(student, self.device),
            as_function(transparency, self.device),
            self.teacher.radiance if "teacher" in self.__dict__ else None,
        )
        self.run.write_json("metrics.json", metrics)
        return metrics

    def _write_sources(self) -> None:
        """Store what the exporter needs of the lamp itself."""
        if (self.run.path / "escaped.npz").is_file():
            self.__dict__["description"] = self.run.description  # spares a resumed run the tracing
            return
        records, triangle = self._traced
        surface = self.luminaire.exit_surface
        self.run.write_json("description.json", self.description.to_dict())
        self.run.write_arrays(
            "surface.npz",
            positions=surface.positions,
            triangles=surface.triangles,
            triangle_flux=triangle_flux(records, triangle, len(surface.triangles)),
        )
        direction, weight = escaped_part(records, ESCAPED)
        self.run.write_arrays("escaped.npz", direction=direction, weight=weight)

    def _metrics(self, student: Student) -> dict[str, Any]:
        """Contents of metrics.json: flux, fidelity, and each stage's time and losses."""
        stages = {
            name: self.run.read_json(f"networks/{name}.json")
            for name in STAGES
            if (self.run.path / "networks" / f"{name}.json").is_file()
        }
        return {
            "flux": list(self.description.flux),
            "flux_error": list(self.description.flux_error),
            "flux_gain": student.gain.tolist(),
            **fidelity(
                as_function(student, self.device),
                self.luminaire.exit_surface,
                self.held_out,
                self._rng("metrics"),
            ),
            "seconds": {
                **{k: round(v, 2) for k, v in self.seconds.items()},
                **{k: v["seconds"] for k, v in stages.items()},
            },
            "losses": {k: v["losses"] for k, v in stages.items()},
            "skipped_steps": {k: v["skipped"] for k, v in stages.items()},
        }

    # Losses; their data is made at the first step

    def _teacher_loss(self, flow: DirectionalFlow) -> Loss:
        batches = TeacherBatches(self._traced[0], self.device)
        size = self.preset.teacher.batch
        return lambda rng: -flow.log_pdf_projected(*batches.draw(rng, size)).mean()

    def _student_loss(self, student: Student) -> Loss:
        teacher, samples = self.teacher, self.preset.distillation_samples
        with self._bar("distillation", samples, "ray") as update:
            data = self._tensors(
                *distillation_set(
                    self.luminaire.exit_surface, teacher, samples, self._rng("distillation"), update
                )
            )
        return lambda rng: student.loss(*_rows(data, rng, self.preset.student.batch))

    def _transparency_loss(self, transparency: Transparency) -> Loss:
        samples, rng = self.preset.transparency_samples, self._rng("transparency")
        data = self._tensors(*throughput_set(self.luminaire, samples, rng, self.seed + 5))
        size = self.preset.transparency.batch
        return lambda rng: transparency.loss(*_rows(data, rng, size))

    def _sampler_loss(self, sampler: Sampler) -> Loss:
        batches, size = SamplerBatches(self.cap_samples), self.preset.sampler.batch
        return lambda rng: -sampler.log_density(*self._tensors(*batches.draw(rng, size))).mean()

    def _fast_map_loss(self, fast_map: FastMap) -> Loss:
        data = self._tensors(self.cap_samples.point, self.cap_samples.radiance)
        return lambda rng: fast_map.loss(*_rows(data, rng, self.preset.fast_map.batch))

    # Helpers

    def _build(self, name: str, kind: Callable[[Description, Preset], Module]) -> Module:
        """A network with initial weights that depend on the seed and the stage only."""
        torch.manual_seed(self.seed * 1009 + STAGES.index(name))
        return kind(self.description, self.preset).to(self.device)

    def _train(
        self,
        name: str,
        module: Module,
        loss: Callable[[Module], Loss],
        settings: Optimisation,
        finish: Callable[[], None] = lambda: None,
    ) -> None:
        """Optimise a network, or load it when an earlier run finished it."""
        if self.run.finished(name):
            self.run.load(name, module)
            module.to(self.device)
            return
        objective, seed = loss(module), self.seed * 1009 + STAGES.index(name)
        checkpoint = self.run.path / "checkpoints" / f"{name}.safetensors"
        start = time.monotonic()
        with self._bar(name, settings.steps, "step") as update:
            trace = optimise(module, objective, settings, seed, checkpoint, update)
        finish()
        record = {"seconds": round(time.monotonic() - start, 2), **trace.to_dict()}
        self.run.save(name, module, record)

    def _bar(self, name: str, total: int, unit: str) -> Bar:
        title = f"[{STAGES.index(name) + 1}/{len(STAGES)}] {name}"
        return Bar(title, total, unit, lambda s: self.seconds.setdefault(name, s))

    def _rng(self, stage: str, part: int = 0) -> np.random.Generator:
        key = STAGES.index(stage) if stage in STAGES else len(STAGES)
        return np.random.default_rng([self.seed, key, part])

    def _tensors(self, *arrays: Float) -> tuple[Tensor, ...]:
        return tuple(torch.from_numpy(a).to(self.device) for a in arrays)


def _rows(data: tuple[Tensor, ...], rng: np.random.Generator, size: int) -> tuple[Tensor, ...]:
    """The same random rows of several tensors."""
    index = torch.from_numpy(rng.integers(0, len(data[0]), size)).to(data[0].device)
    return tuple(t[index] for t in data)


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
