"""The flux that a radiance field sends out of its lamp."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from purelight_train.learning.cap_samples import Radiance, look
from purelight_train.learning.lines import Lines
from purelight_train.light.exit_surface import ExitSurface

PASS = 1 << 18


def escaping_flux(
    surface: ExitSurface,
    radiance: Radiance,
    lines: Lines,
    rng: np.random.Generator,
    *,
    precision: float = 1e-3,
    most: int = 1 << 23,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    r"""Flux :math:`\int L\,dl` over all lines that leave the lamp, seen from where they go.

    Each line counts where a viewer outside first meets the lamp along it, so that light which would
    meet the lamp again is left out.

    Arguments:
        precision: relative standard error to reach in every channel; lines are added until then.
        most: lines at most.

    Returns:
        flux and standard error in W per channel, each [3].
    """
    first, second, count = np.zeros(3), np.zeros(3), 0
    while count < most:
        origin, direction = lines.sample(PASS, rng)
        seen = look(surface, radiance, origin, direction).astype(np.float64)
        value = seen / lines.density(origin, direction)[:, None]
        first, second, count = first + value.sum(0), second + (value**2).sum(0), count + PASS
        mean = first / count
        error = np.sqrt(np.maximum(second / count - mean**2, 0) / count)
        if (error <= precision * mean).all():
            break
    return mean, error
