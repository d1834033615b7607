"""Maps of signed differences: nothing is saturated, and the scale is told."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_train.report.grading import data_uri

# Of what a scale may end at, in parts of white
STEPS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
# sRGB of as much too dark as the scale goes, halfway there, right, halfway too bright, too bright
RAMP = (
    (0.55, 0.85, 1.0), (0.1, 0.4, 0.85), (0.07, 0.07, 0.08), (0.8, 0.25, 0.08), (1.0, 0.85, 0.4)
)  # fmt: skip
Image = NDArray[np.floating[Any]]


def shown_scale(difference: Image) -> float:
    """The least of `STEPS` that a difference of two pictures' brightness stays within."""
    largest = float(np.abs(difference).max())
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
