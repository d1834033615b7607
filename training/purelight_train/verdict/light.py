"""How near learned light is to traced light where it arrives, with the noise of both taken out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_train.truth.picture import Image, Picture

QUANTILE = 0.9  # of the light, which has errors of at most `within`
FLOOR = 0.01  # of the mean light of a place: what darker places are judged against
SURE = 0.5  # no error is said to be less than this part of its noise


@dataclass(frozen=True)
class Error:
    """Of told light against the true one.

    Arguments:
        within: the quantile of the relative error over the light, noise taken out.
        noise: the same quantile of the noise alone.
        mean: of all the light together, relative.
    """

    within: float
    noise: float
    mean: float


def error(told: Picture, true: Picture) -> Error:
    """How far the light at places is off: `QUANTILE` of the light is nearer to the truth.

    A place's error is |S - T| / T and counts as much as its light T. Halves of both give the noise
    of that: the same quantile of |(S_a - S_b) - (T_a - T_b)| / 2T. Were both normal, their squares
    would add, so noise is taken out so. A quantile over a few thousand places is itself known to
    about 3 %, and what is left of its square to `SURE`² of the noise's: less is not claimed.

    Arguments:
        told, true: light at the same places, [H, W, 3].
    """
    level = np.maximum(true.image, FLOOR * true.image.mean())
    seen = weighted_quantile(np.abs(told.image - true.image) / level, level, QUANTILE)
    (a, b), (c, d) = told.halves, true.halves
    noise = weighted_quantile(np.abs(a - b - (c - d)) / (2 * level), level, QUANTILE)
    within = np.sqrt(max(seen**2 - noise**2, (SURE * noise) ** 2))
    return Error(float(within), noise, ratio(told.image, true.image))


def noise_of(light: Picture) -> float:
    """The relative noise that `QUANTILE` of the light is below."""
    return error(Picture.exact(light.image), light).noise


def ratio(told: Image, true: Image) -> float:
    """Sum of all told light over that of the true one, less one; zero where there is none."""
    total = float(true.sum())
    return float(told.sum()) / total - 1 if total > 0 else 0.0


def weighted_quantile(values: NDArray[np.float64], weights: NDArray[np.float64], q: float) -> float:
    """The value below which the part q of the weight lies."""
    order = np.argsort(values, axis=None)
    reached = np.cumsum(weights.ravel()[order])
    index = int(np.searchsorted(reached, q * reached[-1]))
    return float(values.ravel()[order[min(index, values.size - 1)]])
