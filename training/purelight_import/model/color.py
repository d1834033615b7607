"""Colour of light by its temperature."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_import.model.material import RGB

KELVIN = (500.0, 25_000.0)
C2 = 1.438776877e-2  # second radiation constant in m K (CODATA 2018)
# XYZ to linear Rec.709, whose white is D65 (IEC 61966-2-1)
TO_RGB = np.array([
    [3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570],
])  # fmt: skip


@lru_cache(maxsize=256)
def black_body(kelvin: float) -> RGB:
    """Linear Rec.709 of a black body, of luminance one.

    Planck's law is integrated over the CIE 1931 colour matching functions in the analytic fit of
    Wyman, Sloan and Shirley (2013). Below about 1,900 K the colour is redder than Rec.709 has;
    blue is then zero, and the luminance is kept.
    """
    wavelength = np.arange(360.0, 831.0)
    metres = wavelength * 1e-9
    power = metres**-5 / np.expm1(C2 / (metres * kelvin))
    xyz = matching(wavelength) @ power
    rgb = np.maximum(TO_RGB @ (xyz / xyz[1]), 0)
    r, g, b = (rgb / (LUMINANCE @ rgb)).tolist()
    return r, g, b


def matching(wavelength: NDArray[np.float64]) -> NDArray[np.float64]:
    """CIE 1931 colour matching functions at wavelengths [N] in nm: [3, N] (Wyman et al. 2013)."""

    def lobe(mean: float, below: float, above: float) -> NDArray[np.float64]:
        t = (wavelength - mean) * np.where(wavelength < mean, below, above)
        return np.exp(-0.5 * t * t)

    x = (
        0.362 * lobe(442.0, 0.0624, 0.0374)
        + 1.056 * lobe(599.8, 0.0264, 0.0323)
        - 0.065 * lobe(501.1, 0.0490, 0.0382)
    )
    y = 0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322)
    z = 1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725)
    return np.stack((x, y, z))


def watts(lumens: float, color: RGB) -> RGB:
    """W per channel of light of so many lumens and of a colour of any size."""
    total = float(LUMINANCE @ np.asarray(color))
    r, g, b = (lumens / LUMENS_PER_WATT * np.asarray(color) / total).tolist()
    return r, g, b
