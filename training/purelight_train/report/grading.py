"""From radiance to pictures for the eye: white balance, exposure, and colours for errors."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE
from purelight_format.srgb import decode, encode, plain_png, tone

Image = NDArray[np.floating[Any]]


@dataclass(frozen=True)
class Grade:
    """How radiance becomes a picture: gains per channel, then stops of exposure."""

    gains: tuple[float, float, float]
    stops: float

    def uri(self, image: Image) -> str:
        """The graded picture as a `data:` address."""
        return data_uri(encode(self._toned(image)))

    def shown(self, image: Image) -> NDArray[np.float64]:
        """How bright the graded picture is on a screen: [H, W] in 0 .. 1."""
        brightness: NDArray[np.float64] = encode(self._toned(image) @ LUMINANCE)
        return brightness

    def _toned(self, image: Image) -> Image:
        return tone(image * np.asarray(self.gains), self.stops)


def data_uri(code: Image) -> str:
    """sRGB [H, W, 3] in 0 .. 1 as a `data:` address."""
    return "data:image/png;base64," + base64.b64encode(plain_png(decode(code))).decode()


def heat(values: Image, white: float) -> str:
    """Values [H, W] up to `white` as black, red, yellow, white, as a `data:` address."""
    x = np.clip(values / white, 0, 1)
    ramp = np.stack((np.clip(3 * x, 0, 1), np.clip(3 * x - 1, 0, 1), np.clip(3 * x - 2, 0, 1)), -1)
    return data_uri(ramp)


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
