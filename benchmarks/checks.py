"""All checks of a bundle by name."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.see_through import transmittance
from tests.support.fidelity import (
    Figures,
    Subject,
    appearance,
    far_field,
    fast_map,
    flux,
    hosts,
    irradiance,
    sampler,
)

CHECKS: dict[str, Callable[[Subject], Figures]] = {
    "flux": flux,
    "irradiance": irradiance,
    "far_field": far_field,
    "appearance": appearance,
    "transmittance": transmittance,
    "sampler": sampler,
    "fast_map": fast_map,
    "hosts": hosts,
}
