"""All figures of a lamp by name."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.zoo.figures.case import Case
from benchmarks.zoo.figures.floors import floor, reference
from benchmarks.zoo.figures.rooms import near_field, room
from benchmarks.zoo.figures.views import appearance, transmittance
from tests.support import fidelity
from tests.support.fidelity import Figures


def flux(case: Case) -> Figures:
    """Flux of the student and of the IES file over the traced one."""
    return fidelity.flux(case.subject)


def far_field(case: Case) -> Figures:
    """The IES file's table against counted light."""
    return fidelity.far_field(case.subject, case.settings.far_paths)


def sampler(case: Case) -> Figures:
    """Effective sample size and the rest, at random shading points."""
    return fidelity.sampler(case.subject, case.settings.sampler_points)


def fast_map(case: Case) -> Figures:
    """Bias of the fast map against the networks it stands for."""
    return fidelity.fast_map(case.subject, case.settings.map_points)


FIGURES: dict[str, Callable[[Case], Figures]] = {
    "flux": flux,
    "floor": floor,
    "reference": reference,
    "far_field": far_field,
    "transmittance": transmittance,
    "appearance": appearance,
    "sampler": sampler,
    "fast_map": fast_map,
    "room": room,
    "near_field": near_field,
}
