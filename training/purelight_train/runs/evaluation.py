"""Trained networks as functions of NumPy arrays, and what they are worth."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from purelight_train.learning.cap_samples import Radiance
from purelight_train.learning.flux_closure import surface_flux
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.networks.student import MAX_LOG, Student
from purelight_train.runs import preview
from purelight_train.runs.run_directory import RunDirectory

Float = NDArray[np.float32]
BATCH = 1 << 15
FLUX_SAMPLES = 1 << 20
BRIGHTER, HEADROOM = 1e-4, 2.0


def as_function(network: nn.Module, device: torch.device) -> Radiance:
    """A surface network (student, transparency) as a function of three arrays [N, 3]."""

    @torch.no_grad()
    def evaluate(position: Float, normal: Float, outgoing: Float) -> Float:
        result = np.empty_like(position)
        for i in range(0, len(position), BATCH):
            part = slice(i, i + BATCH)
            tensors = (torch.from_numpy(a[part]).to(device) for a in (position, normal, outgoing))
            result[part] = network(*tensors).cpu().numpy()
        return result

    return evaluate


def set_ceiling(student: Student, radiance: Radiance, held_out: ExitRecords) -> None:
    """Bound the student by `HEADROOM` times the radiance of held-out light.

    Light comes from places in proportion to their radiance, so it has seen the brightest there is;
    the brightest part `BRIGHTER` of its power may be the student's own error and is left out.

    Arguments:
        radiance: the student's, in W/(m² sr): three of [N, 3] -> [N, 3].
        held_out: records that it did not learn from, settled on the exit surface.
    """
    present = student.channels.bool().cpu()
    if not present.any():
        return
    value = radiance(held_out.position, held_out.normal, held_out.direction)
    unit = (value / (student.scale * student.gain).cpu().numpy())[:, present].max(1)
    power = held_out.weight.sum(1, dtype=np.float64)
    order = np.argsort(unit)
    index = np.searchsorted(np.cumsum(power[order]), (1 - BRIGHTER) * power.sum())
    bound = HEADROOM * float(unit[order[min(index, len(order) - 1)]])
    log = np.log(bound) if student.link == "log" else np.log1p(bound)
    student.ceiling.fill_(float(np.clip(log, student.least_log, MAX_LOG)))


def close_flux(
    student: Student,
    radiance: Radiance,
    surface: ExitSurface,
    flux: tuple[float, float, float],
    rng: np.random.Generator,
) -> None:
    """Set the gain that makes the student's integral equal the light-traced flux."""
    integral, _ = surface_flux(surface, radiance, FLUX_SAMPLES, rng)
    gain = np.divide(np.asarray(flux), integral, out=np.ones(3), where=integral > 0)
    student.gain.copy_(torch.from_numpy(gain))


def fidelity(
    radiance: Radiance, surface: ExitSurface, held_out: ExitRecords, rng: np.random.Generator
) -> dict[str, Any]:
    r"""How near a radiance field is to the lamp.

    Returns:
        its flux and the standard error of that in W, and the mean log-likelihood of light it was
        not trained on, in nats over a uniform Lambertian surface of the same flux.
    """
    flux, error = surface_flux(surface, radiance, FLUX_SAMPLES, rng)
    return {
        "student_flux": flux.tolist(),
        "student_flux_error": error.tolist(),
        "held_out_gain_nats": _gain(radiance, surface, held_out, float(flux.sum())),
    }


def held_out_gain(radiance: Radiance, surface: ExitSurface, held_out: ExitRecords) -> float:
    """`fidelity`'s likelihood in a tenth of its time, with the same random numbers every time."""
    flux, _ = surface_flux(surface, radiance, FLUX_SAMPLES >> 4, np.random.default_rng(0))
    return _gain(radiance, surface, held_out.take(slice(FLUX_SAMPLES >> 6)), float(flux.sum()))


def _gain(radiance: Radiance, surface: ExitSurface, held_out: ExitRecords, flux: float) -> float:
    value = radiance(held_out.position, held_out.normal, held_out.direction)
    density = value.sum(1) / flux * (np.pi * surface.area)
    power = held_out.weight.sum(1, dtype=np.float64)
    return float(np.average(np.log(np.maximum(density, 1e-6)), weights=power))


def write_previews(
    run: RunDirectory,
    surface: ExitSurface,
    student: Radiance,
    transparency: Radiance,
    teacher: Radiance | None,
) -> None:
    """Pictures of the lamp: student from two sides, transparency, and teacher beside student."""
    folder = run.path / "previews"
    views = [preview.view(surface, student, 256, 35, e) for e in (10.0, -50.0)]
    preview.save_row(folder / "student.png", views)
    through = preview.view(surface, transparency, 256, 35, 10.0)
    preview.save_png(folder / "transparency.png", preview.tone_map(through, 1.0))
    if teacher is not None:
        picture = preview.view(surface, teacher, 256, 35, 10.0)
        preview.save_row(folder / "teacher_student.png", [picture, views[0]])
