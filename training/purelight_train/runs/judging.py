"""What a run's networks are worth: its verdict, from networks as functions of NumPy arrays."""

from __future__ import annotations

import numpy as np
import torch

from purelight_format.verdict.figures import Verdict
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.radiance_field import Float, Radiance
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.runs.evaluation import as_function, gain
from purelight_train.runs.trained import FAST_MAP, SAMPLER, STUDENT
from purelight_train.runs.trainer import Trainer
from purelight_train.verdict.arriving import Map, Sample
from purelight_train.verdict.measure import Judge, Learned

SOME = 1 << 17  # records that were learned from


def judge(trainer: Trainer) -> Judge:
    """Who measures a finished run; the light it needs is traced when it is asked."""
    return judge_of(
        trainer, trainer.network(STUDENT), trainer.network(SAMPLER), trainer.network(FAST_MAP)
    )


def judge_of(trainer: Trainer, student: Student, sampler: Sampler, fast_map: FastMap) -> Judge:
    """Who measures other networks of a run's lamp."""
    lamp, device = trainer.lamp, trainer.stages.device
    learned = Learned(
        lamp.reference_rays, as_function(student, device), _sample(sampler, device),
        _fast_map(fast_map, device),
    )  # fmt: skip
    luminaire = lamp.luminaire
    if not isinstance(luminaire, Luminaire):
        raise TypeError("measured rays cannot be traced afresh")
    return Judge(
        luminaire.scene, lamp.description.sphere, learned, trainer.preset.paths,
        trainer.stages.seed,
    )  # fmt: skip


def verdict(trainer: Trainer, judge: Judge) -> Verdict:
    """The verdict on a finished run, with a progress bar."""
    with trainer.stages.bar("verdict", judge.total, "path") as judge.progress:
        return judge.verdict(by_heart(trainer, judge.learned.student))


def by_heart(trainer: Trainer, student: Radiance) -> float | None:
    """How much likelier light that was learned from is, in nats; None where all was fresh."""
    if trainer.route.learned_from is None:
        return None
    lamp, flux = trainer.lamp, np.asarray(trainer.lamp.description.flux)
    learned, other = (
        gain(student, lamp.surface, records, flux)
        for records in (trainer.route.learned_from.take(slice(SOME)), lamp.held_out)
    )
    return learned - other


def _sample(sampler: Sampler, device: torch.device) -> Sample:
    @torch.no_grad()
    def draw(point: Float, u: Float) -> tuple[Float, Float]:
        toward, pdf = sampler(*(torch.from_numpy(a).to(device) for a in (point, u)))
        return toward.cpu().numpy(), pdf.cpu().numpy()

    return draw


def _fast_map(fast_map: FastMap, device: torch.device) -> Map:
    @torch.no_grad()
    def evaluate(point: Float) -> Float:
        cells: Float = fast_map(torch.from_numpy(point).to(device)).cpu().numpy()
        return cells

    return evaluate
