"""Trained networks as functions of NumPy arrays, and what they are worth."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from purelight_train.learning.flux_closure import (
    DirectionalLight,
    bounded,
    cell_directions,
    effective_size,
    escaping_flux,
    moments_of,
    tilt,
)
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.radiance_field import Float, Radiance, portrait
from purelight_train.networks.student import MAX_LOG, Student
from purelight_train.runs.preview import save_row
from purelight_train.runs.progress import Bar
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.traced_lamp import TracedLamp

BATCH = 1 << 15
Cells = NDArray[np.float64]
FEW_RAYS, FEW_RECORDS = 1 << 18, 1 << 14
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


def set_ceiling(
    student: Student, radiance: Radiance, held_out: ExitRecords, brightest: NDArray[np.float64]
) -> None:
    """Bound each channel of the student by `HEADROOM` times what light can have there.

    No radiance outside a lamp is larger than that of its emitters, nor than the student's own where
    held-out light left. Emitters without area have no largest radiance; then the brightest part
    `BRIGHTER` of the held-out power may be the student's own error and is left out. Of a channel
    of so little light that none was held out, all places count alike.

    Arguments:
        radiance: the student's, in W/(m² sr): three of [N, 3] -> [N, 3].
        held_out: records that it did not learn from, settled on the exit surface.
        brightest: radiance of the emitters, [3].
    """
    value = radiance(held_out.position, held_out.normal, held_out.direction).astype(np.float64)
    unit = (student.scale * student.gain).cpu().double().numpy()
    for c in np.flatnonzero(student.channels.cpu().numpy()):
        power = held_out.weight[:, c].astype(np.float64)
        if not power.any():
            power[:] = 1.0
        seen, power = value[power > 0, c], power[power > 0]
        bound = brightest[c] if np.isfinite(brightest[c]) else _quantile(seen, power, 1 - BRIGHTER)
        bound = HEADROOM * min(bound, seen.max()) / unit[c]
        log = np.log(bound) if student.link == "log" else np.log1p(bound)
        student.ceiling[c] = float(np.clip(log, student.least_log, MAX_LOG))


def _quantile(value: NDArray[np.float64], weight: NDArray[np.float64], part: float) -> float:
    """The value below which lies `part` of the weight."""
    order = np.argsort(value)
    index = int(np.searchsorted(np.cumsum(weight[order]), part * weight.sum()))
    return float(value[order[min(index, len(order) - 1)]])


def close_flux(
    student: Student, radiance: Radiance, lamp: TracedLamp, rng: np.random.Generator
) -> None:
    """Make the student's escaping flux the light-traced one, in all and by direction."""
    told = DirectionalLight()
    with _flux_bar("flux of the student") as bar:
        integral, _ = escaping_flux(
            lamp.reference_rays, radiance, rng, visit=told.add, progress=bar.part
        )
    flux = np.asarray(lamp.description.flux)
    gain = np.divide(flux, integral, out=np.ones(3), where=integral > 0)
    student.gain.copy_(student.gain.cpu() * torch.from_numpy(gain))
    escaped = lamp.records.take(lamp.records.escaped)
    _tilt(student, told, escaped.direction, escaped.weight.astype(np.float64))


def _flux_bar(title: str) -> Bar:
    """Of an integral of as many rays as its precision takes."""
    return Bar(title, 100, "%", lambda _: None)


def _tilt(student: Student, told: DirectionalLight, direction: Float, weight: Cells) -> None:
    """Give the student's light the direction harmonics of traced light.

    Arguments:
        told: the student's.
        direction, weight: of traced light, [N, 3].
    """

    def harmonics(toward: Float) -> Cells:
        given = torch.from_numpy(np.ascontiguousarray(toward, np.float32))
        value: Cells = student.harmonics(given.to(student.tilt.device)).cpu().double().numpy()
        return value

    there, everywhere = harmonics(told.toward()), harmonics(cell_directions())
    moments = moments_of(lambda part: harmonics(direction[part]), weight)
    records = effective_size(weight)
    for c in range(3):
        more = tilt(told.power[:, c], there, moments[c], float(records[c]))
        more = bounded(more, told.power[:, c], there, everywhere)
        student.tilt[c] += torch.from_numpy(more).to(student.tilt)


def fidelity(radiance: Radiance, lamp: TracedLamp, rng: np.random.Generator) -> dict[str, Any]:
    r"""How near a radiance field is to the lamp.

    Returns:
        its flux and the standard error of that in W, and the mean log-likelihood of light it was
        not trained on, in nats over a uniform Lambertian surface of the same flux.
    """
    with _flux_bar("flux, for the metrics") as bar:
        flux, error = escaping_flux(lamp.reference_rays, radiance, rng, progress=bar.part)
    return {
        "student_flux": flux.tolist(),
        "student_flux_error": error.tolist(),
        "held_out_gain_nats": gain(radiance, lamp.surface, lamp.held_out, flux),
    }


def held_out_gain(radiance: Radiance, lamp: TracedLamp) -> float:
    """`fidelity`'s likelihood in a tenth of its time, with the same random numbers every time."""
    rng = np.random.default_rng(0)
    flux, _ = escaping_flux(lamp.reference_rays, radiance, rng, most=FEW_RAYS)
    return gain(radiance, lamp.surface, lamp.held_out.take(slice(FEW_RECORDS)), flux)


def gain(
    radiance: Radiance, surface: ExitSurface, held_out: ExitRecords, flux: NDArray[np.float64]
) -> float:
    """Mean of log(radiance over that of a Lambertian surface), over the light that escapes."""
    part = held_out.take(held_out.escaped)
    value = radiance(part.position, part.normal, part.direction)
    density = value.sum(1) / flux.sum() * (np.pi * surface.area)
    power = part.weight.sum(1, dtype=np.float64)
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
    views = [portrait(surface, student, 256, 35, e) for e in (10.0, -50.0)]
    save_row(folder / "student.png", views)
    save_row(folder / "transparency.png", [portrait(surface, transparency, 256, 35, 10.0)], 1.0)
    if teacher is not None:
        picture = portrait(surface, teacher, 256, 35, 10.0)
        save_row(folder / "teacher_student.png", [picture, views[0]])
