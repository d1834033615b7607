"""Maps of signed differences, each with the scale that its own values need, which is told."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE
from purelight_train.report.grading import data_uri
from purelight_train.truth.metrics import MAPE_FLOOR

# Of what a scale may end at, in parts of white or of the truth
STEPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
BEYOND = 0.01  # of the pixels may lie beyond the end of a scale of relative errors
# sRGB of as much too dark as the scale goes, halfway there, right, halfway too bright, too bright
RAMP = (
    (0.55, 0.85, 1.0), (0.1, 0.4, 0.85), (0.07, 0.07, 0.08), (0.8, 0.25, 0.08), (1.0, 0.85, 0.4)
)  # fmt: skip
Image = NDArray[np.floating[Any]]


def shown_scale(difference: Image) -> float:
    """The least of `STEPS` that a difference of two pictures' brightness stays within."""
    return _scale(float(np.abs(difference).max()))


def relative(image: Image, truth: Image) -> NDArray[np.float64]:
    """Signed error of each pixel's luminance over the truth's: [H, W].

    As in `mape`, 0.01 of the truth's mean is added to the denominator.

    Arguments:
        image, truth: linear [H, W, 3].
    """
    one, other = image @ LUMINANCE, truth @ LUMINANCE
    floor = max(MAPE_FLOOR * float(other.mean()), 1e-300)
    result: NDArray[np.float64] = (one - other) / (other + floor)
    return result


def relative_scale(error: Image) -> float:
    """The least of `STEPS` that all but `BEYOND` of the relative errors stay within."""
    return _scale(float(np.quantile(np.abs(error), 1 - BEYOND)))


def _scale(largest: float) -> float:
    return next((step for step in STEPS if largest <= step), STEPS[-1])


def shown(difference: Image, scale: float) -> str:
    """Signed differences [H, W] up to a scale as colours, as a `data:` address."""
    at = np.clip(difference / scale, -1, 1)
    stops = np.linspace(-1, 1, len(RAMP))
    colours = np.array(RAMP).T
    return data_uri(np.stack([np.interp(at, stops, values) for values in colours], -1))


def gradient() -> str:
    """The colours from too dark to too bright, as CSS has them."""
    codes = (f"rgb({','.join(str(round(255 * x)) for x in colour)})" for colour in RAMP)
    return f"linear-gradient(to right, {', '.join(codes)})"
