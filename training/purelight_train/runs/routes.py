"""Two routes from light to the student: distilled from a teacher, or fitted to photons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
import torch

from purelight_train.learning.photon_batches import PhotonBatches
from purelight_train.learning.photon_loss import brightest_of, chosen_loss, student_loss
from purelight_train.learning.teacher import DirectionalFlow, FreshBatches, PowerBatches, Teacher
from purelight_train.learning.training_sets import distillation_set
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.positional_density import PositionalDensity
from purelight_train.light.radiance_field import Radiance
from purelight_train.networks.student import Student
from purelight_train.presets import Optimisation, Preset
from purelight_train.runs.evaluation import as_function, close_flux, held_out_gain, set_ceiling
from purelight_train.runs.stages import Loss, Stages, rows
from purelight_train.runs.traced_lamp import TracedLamp

HELD_OUT_BATCH = 1 << 14


@dataclass
class Route:
    """One way to a student, whose data are gathered in the stages that it names."""

    gathers: ClassVar[tuple[str, ...]] = ()

    lamp: TracedLamp
    preset: Preset
    stages: Stages

    @property
    def teacher_radiance(self) -> Radiance | None:
        """The teacher's radiance, if this process has a teacher."""
        return None

    @property
    def learned_from(self) -> ExitRecords | None:
        """The stored light that all is learned from; None where each step has light of its own."""
        return None

    @property
    def optimisation(self) -> Optimisation:
        """How the student is optimised."""
        raise NotImplementedError

    def loss(self, student: Student) -> Loss:
        """The student's objective; its data are made here."""
        raise NotImplementedError

    def held_out(self, student: Student) -> Callable[[], float]:
        """The student's error on held-out light, in nats."""
        radiance, lamp = as_function(student, self.stages.device), self.lamp
        return lambda: -held_out_gain(radiance, lamp)

    def close(self, student: Student) -> None:
        """Bound the trained student, and make its flux the traced one."""
        radiance = as_function(student, self.stages.device)
        set_ceiling(student, radiance, self.lamp.held_out, self.lamp.emission.brightest())
        close_flux(student, radiance, self.lamp, self.stages.rng("student", 1))


class TeacherRoute(Route):
    """The paper's: photon map and directional flow make the teacher, the student regresses it."""

    gathers = ("light", "teacher", "distillation")

    @property
    def learned_from(self) -> ExitRecords | None:
        return None if self.preset.fresh_records else self.lamp.records

    @property
    def optimisation(self) -> Optimisation:
        return self.preset.student

    @property
    def teacher_radiance(self) -> Radiance | None:
        return self.teacher.radiance if "teacher" in self.__dict__ else None

    @cached_property
    def density(self) -> PositionalDensity:
        return PositionalDensity.build(
            self.lamp.records, self.lamp.surface, self.preset.density_neighbours,
            self.stages.rng("distillation", 1),
        )  # fmt: skip

    @cached_property
    def teacher(self) -> Teacher:
        description = self.lamp.description
        flow = self.stages.build("teacher", DirectionalFlow, description, self.preset)
        self.stages.train(
            "teacher", flow, self._teacher_loss, self.preset.teacher, held_out=self._held_out_flow
        )
        return Teacher(description, self.lamp.surface, self.density, flow)

    def _held_out_flow(self, flow: DirectionalFlow) -> Callable[[], float]:
        """The flow's error on directions of held-out light, in nats."""
        batches = PowerBatches(self.lamp.held_out, self.stages.device)
        drawn = batches.draw(np.random.default_rng(0), HELD_OUT_BATCH)

        @torch.no_grad()
        def error() -> float:
            return -float(flow.log_pdf_projected(*drawn).mean())

        return error

    def _teacher_loss(self, flow: DirectionalFlow) -> Loss:
        device, size = self.stages.device, self.preset.teacher.batch
        batches = (
            FreshBatches(self.lamp.luminaire, device)
            if self.preset.fresh_records
            else PowerBatches(self.lamp.records, device)
        )
        return lambda rng: -flow.log_pdf_projected(*batches.draw(rng, size)).mean()

    def loss(self, student: Student) -> Loss:
        samples, rng = self.preset.distillation_samples, self.stages.rng("distillation")
        teacher = self.teacher
        with self.stages.bar("distillation", samples, "ray") as update:
            arrays = distillation_set(self.lamp.surface, teacher, samples, rng, update)
        data = self.stages.tensors(*arrays)
        return lambda step: student.loss(*rows(data, step, self.preset.student.batch))


class PhotonRoute(Route):
    """Ours: the student itself is fitted to light as it is traced; there is no teacher."""

    gathers = ("light",)

    @property
    def optimisation(self) -> Optimisation:
        return self.preset.photons

    def loss(self, student: Student) -> Loss:
        return photon_objective(
            student, self.lamp, self.preset, self.lamp.photon_batches(self.preset)
        )


def photon_objective(
    student: Student, lamp: TracedLamp, preset: Preset, batches: PhotonBatches
) -> Loss:
    """What a student minimises on the route `photons`."""
    least = batches.reference_rays.least_ratio
    brightest = brightest_of(student, lamp.emission.brightest(), least)
    loss, size = chosen_loss(preset, brightest), preset.photons.batch
    return lambda rng: student_loss(student, *batches.draw(rng, size), loss)


ROUTES: dict[str, type[TeacherRoute] | type[PhotonRoute]] = {
    "teacher": TeacherRoute,
    "photons": PhotonRoute,
}
