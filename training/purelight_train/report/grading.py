"""From radiance to pictures for the eye: white balance, exposure, and colours for errors."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE
from purelight_format.srgb import png

Image = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Grade:
    """How radiance becomes a picture: gains per channel, then stops of exposure."""

    gains: tuple[float, float, float]
    stops: float

    def uri(self, image: Image) -> str:
        """The graded picture as a `data:` address."""
        encoded = png(image * np.asarray(self.gains), self.stops)
        return "data:image/png;base64," + base64.b64encode(encoded).decode()


def heat(error: Image, white: float) -> str:
    """A relative error [H, W] as black, red, yellow, white, as a `data:` address."""
    x = np.clip(error / white, 0, 1)
    ramp = np.stack((np.clip(3 * x, 0, 1), np.clip(3 * x - 1, 0, 1), np.clip(3 * x - 2, 0, 1)), -1)
    # Undo the tone curve, so that the ramp is what one sees
    linear = -np.log1p(-0.999 * ramp**2.2) / 1.5
    return Grade((1.0, 1.0, 1.0), 0.0).uri(linear)


def white_balance(flux: Sequence[float], strength: float = 0.7) -> tuple[float, float, float]:
    """Gains that move the lamp's colour most of the way to white, at equal luminance."""
    present = np.maximum(np.asarray(flux, np.float64), 1e-3 * max(flux))
    gains = present**-strength
    gains *= (LUMINANCE @ present) / (LUMINANCE @ (gains * present))
    r, g, b = gains.tolist()
    return r, g, b


def exposure(image: Image, percentile: float) -> float:
    """Stops that bring a percentile of the luminance to white."""
    level = float(np.percentile(image @ LUMINANCE, percentile))
    return -float(np.log2(level)) if level > 0 else 0.0


def lamp_grade(flux: Sequence[float], lit: Image, percentile: float) -> Grade:
    """Balanced towards the lamp's colour, and exposed for its lit pixels [N, 3]."""
    gains = white_balance(flux)
    return Grade(gains, exposure(lit[None] * gains, percentile))
