"""The networks that runs train, one declaration each, and how their data are gathered."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from purelight_train.learning.aimed_samples import aimed_samples, cell_means
from purelight_train.learning.cap_samples import CapSamples, learned_points
from purelight_train.learning.map_closure import close_light
from purelight_train.learning.training_sets import SamplerBatches, SurfaceSet, transmittance_set
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.networks.student import Student
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Optimisation
from purelight_train.runs.evaluation import as_function
from purelight_train.runs.progress import Bar
from purelight_train.runs.stages import Loss
from purelight_train.runs.trainer import Float, Trained, Trainer, over

# Student

STUDENT = Trained(
    "student",
    Student,
    settings=lambda trainer: trainer.route.optimisation,
    loss=lambda trainer, student, _: trainer.route.loss(student),
    finish=lambda trainer, student: trainer.route.close(student),
    held_out=lambda trainer, student: trainer.route.held_out(student),
)

# Transparency


def see_through(trainer: Trainer) -> SurfaceSet:
    """Lines through the lamp and what comes through."""
    samples, rng = trainer.preset.transparency_samples, trainer.stages.rng("transparency")
    return transmittance_set(trainer.lamp.modelled, samples, rng, trainer.stages.seed + 5)


def is_opaque(trainer: Trainer) -> bool:
    """Whether no light passes straight, or it is not known whether any does."""
    return trainer.lamp.luminaire.opaque or not trainer.data(see_through)[-1].any()


TRANSPARENCY = Trained(
    "transparency",
    Transparency,
    settings=lambda trainer: trainer.preset.transparency,
    loss=over(see_through),
    left_out=is_opaque,
)

# Sampler, and the pilot that shows where to look again: each takes half of the steps


def cap_samples(trainer: Trainer) -> CapSamples:
    """What shading points see of the lamp in even directions."""
    lamp, student = trainer.lamp, as_function(trainer.network(STUDENT), trainer.stages.device)
    count, rng = trainer.preset.cap_points, trainer.stages.rng("cap")
    point = learned_points(lamp.description, lamp.records, count, rng)
    with trainer.stages.bar("cap", count, "point") as update:
        return CapSamples.gather(lamp.description, lamp.surface, student, point, rng, update)


def aimed(trainer: Trainer) -> CapSamples:
    """The even samples, and as many that the pilot aims."""
    lamp, student = trainer.lamp, as_function(trainer.network(STUDENT), trainer.stages.device)
    even, pilot = trainer.data(cap_samples), trainer.network(PILOT)
    with trainer.stages.bar("aim", trainer.preset.cap_points, "point") as update:
        return aimed_samples(
            even, pilot, lamp.description, lamp.surface, student, trainer.stages.rng("aim"), update
        )


def _half(trainer: Trainer) -> Optimisation:
    return replace(trainer.preset.sampler, steps=trainer.preset.sampler.steps // 2)


def _sampler_loss(
    gather: Callable[[Trainer], CapSamples],
) -> Callable[[Trainer, Sampler, int], Loss]:
    def loss(trainer: Trainer, sampler: Sampler, size: int) -> Loss:
        lamp, device = trainer.lamp, trainer.stages.device
        batches = SamplerBatches(trainer.data(gather), lamp.description, device)
        return lambda rng: -sampler.log_density(*batches.draw(rng, size)).mean()

    return loss


PILOT = Trained("pilot", Sampler, _half, _sampler_loss(cap_samples))
SAMPLER = Trained(
    "sampler",
    Sampler,
    settings=_half,
    loss=_sampler_loss(aimed),
    gathers=("cap", "pilot", "aim"),
    begin=lambda trainer, sampler: sampler.load_state_dict(trainer.network(PILOT).state_dict()),
)

# Fast map


def cells(trainer: Trainer) -> tuple[Float, Float]:
    """Points and the mean radiance in the cells of their caps."""
    samples = trainer.data(aimed)
    return samples.point, cell_means(samples)


def _close(trainer: Trainer, fast_map: FastMap) -> None:
    fast_map.set_ceiling(*trainer.stages.tensors(trainer.data(cells)[1]))
    knots = len(fast_map.tilt)
    with Bar("light of the fast map", knots, "distance", lambda _: None) as update:
        close_light(fast_map, trainer.lamp.records, update)


FAST_MAP = Trained(
    "fast_map",
    FastMap,
    settings=lambda trainer: trainer.preset.fast_map,
    loss=over(cells),
    finish=_close,
)

# In this order; the pilot is trained when the sampler asks for it
TRAINED: tuple[Trained[Any], ...] = (STUDENT, TRANSPARENCY, SAMPLER, FAST_MAP)
