"""Light on floors below a lamp: its own, and what it lets through of the sun."""

from __future__ import annotations

import numpy as np

from benchmarks.zoo.figures import scenes
from benchmarks.zoo.figures.case import SETTLED, Case
from tests.support import fidelity
from tests.support.fidelity import Figures

FLOOR, FLOOR_SIDE, CELLS = 4.0, 8.0, 16  # below the lamp's centre, and edge, in radii
SHADOW, SHADOW_SIDE, SHADOW_CELLS = 1.6, 2.0, 32
PASSES, PATH_PASSES = 8, 128  # of Mitsuba's; a path tracer seldom finds what its noise is made of


def floor(case: Case) -> Figures:
    """Irradiance on a floor four radii below, in both modes, over light traced by our tracer.

    `at_own_size` is the mean of the accurate mode there over that of the enlarged lamp, less one.
    """
    plane = case.plane(FLOOR, FLOOR_SIDE, CELLS)
    true, noise = fidelity.traced_plane(case.subject.lamp, plane, case.settings.floor_paths, 77)
    power = true.mean((0, 1)) * plane.side**2
    figures: Figures = {
        "flux_share": float(power.sum() / sum(case.subject.description.flux)),
        "irradiance": true.mean((0, 1)).tolist(),
        "standard_error": (np.sqrt((noise**2).sum((0, 1))) / CELLS**2).tolist(),
    }
    if not true.any():
        return figures
    figures["truth_noise"] = float(noise.mean() / true.mean())
    spp = case.settings.floor_spp
    for mode in ("accurate", "fast"):
        lamp, integrator = case.ours(mode)
        told = fidelity.floor_irradiance(lamp, integrator, case.large.plane(plane), spp)
        figures[mode] = fidelity.plane_errors(told, true)
        if mode == "accurate":
            own = fidelity.plane_render(case.subject, plane, mode, spp)
            figures["at_own_size"] = float(own.mean() / told.mean() - 1) if told.any() else None
            figures["rendered"] = told.mean((0, 1)).tolist()
    return figures


def reference(case: Case) -> Figures:
    """The same floor by Mitsuba's own integrators; mean of the channels, with standard errors."""
    plane = case.large.plane(case.plane(FLOOR, FLOOR_SIDE, CELLS))
    spp = max(case.settings.reference_paths // (CELLS**2 * PASSES), 1)
    means = [
        fidelity.floor_irradiance(case.large.lit, case.large.integrator, plane, spp, seed).mean()
        for seed in range(PASSES if case.large.light_traceable else PATH_PASSES)
    ]
    mean = float(np.mean(means))
    error = float(np.std(means, ddof=1) / np.sqrt(len(means)))
    figures: Figures = {
        "integrator": case.large.integrator["type"],
        "irradiance": mean,
        "standard_error": error,
    }
    able = case.large.light_traceable or case.large.path_traceable
    return figures | {"settled": bool(able and mean > 0 and error < SETTLED * mean)}


def shadow(case: Case) -> Figures:
    """Sunlight that reaches a floor under the lamp, as part of what would without it."""
    plane = case.large.plane(case.plane(SHADOW, SHADOW_SIDE, SHADOW_CELLS))
    sun = scenes.sun()
    spp = max(case.settings.reference_paths // SHADOW_CELLS**2, 1)
    true = fidelity.floor_irradiance(case.large.dark | sun, case.large.integrator, plane, spp)
    lamp, integrator = case.ours("accurate", dimmer=0.0)
    told = fidelity.floor_irradiance(lamp | sun, integrator, plane, case.settings.floor_spp // 16)
    return {
        "truth": float(true.mean()),
        "mean": float(told.mean() - true.mean()),
        "absolute": float(np.abs(told - true).mean()),
    }
