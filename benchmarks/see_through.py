"""How near a bundle's transmittance is to what the unlit lamp lets through."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from purelight_mitsuba.scene_file import load_scene
from purelight_train.truth.backlit import Backlit
from tests.support.fidelity import Figures, Image, Subject

PANELS, GLASS_RAYS = (15.0, 89.9), 16
VIEWS = ((30.0, 10.0), (30.0, -50.0))  # azimuth and elevation


def transmittance(subject: Subject, size: int = 64, spp: int = 512) -> Figures:
    """What the unlit lamp lets through, from two sides, before panels of 15 degrees and more.

    Over the silhouette: the truth's mean, the mean difference from it, and the root of the mean
    square one, each without the truth's noise. Light that a lamp turns by more than 15 degrees is
    no line's, and only the wide panel shows it.
    """
    return {
        f"panel of {angle} degrees": _before_panel(subject, size, spp, angle) for angle in PANELS
    }


def _before_panel(subject: Subject, size: int, spp: int, half_angle: float) -> Figures:
    told: list[Image] = []
    true: list[Image] = []
    again: list[Image] = []
    for azimuth, elevation in VIEWS:
        view = Backlit(subject.description.sphere, size, azimuth, elevation, half_angle)
        lines = [view.lines(np.random.default_rng([9, k])) for k in range(GLASS_RAYS)]
        passing = np.mean([_passing(subject, *line) for line in lines], 0)
        met = np.isfinite(passing).all(1)
        told.append(passing[met])
        for halves, seed in ((true, 1), (again, 2)):
            lamp = load_scene(subject.scene)
            halves.append(view.transmitted(lamp, spp // 2, seed).reshape(-1, 3)[met])
    ours, first, second = (np.concatenate(part) for part in (told, true, again))
    square = ((ours - first) * (ours - second)).mean()
    return {
        "truth": float(0.5 * (first + second).mean()),
        "mean": float((ours - 0.5 * (first + second)).mean()),
        "root_mean_square": float(np.sign(square) * np.sqrt(abs(square))),
        "noise": float(0.5 * np.sqrt(((first - second) ** 2).mean())),
    }


def _passing(
    subject: Subject, origin: NDArray[np.float32], direction: NDArray[np.float32]
) -> NDArray[np.float64]:
    """Transmittance of lines; NaN where the lamp is not met: two of [N, 3] -> [N, 3]."""
    hits = subject.surface.intersect(origin, direction)
    result = np.full(origin.shape, np.nan)
    result[hits.index] = subject.transmittance(hits.position, hits.normal, -direction[hits.index])
    return result
