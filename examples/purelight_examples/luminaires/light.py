"""The light of emitters: radiance for a luminous flux and a colour temperature."""

from __future__ import annotations

import numpy as np

from purelight_examples.luminaires.lamp_scene import RGB
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE

RADIATION = 1.438776877e-2  # second constant of radiation, m K
TO_REC709 = np.array([
    [3.2404542, -1.5371385, -0.4985314],
    [-0.9692660, 1.8760108, 0.0415560],
    [0.0556434, -0.2040259, 1.0572252],
])  # fmt: skip
LOBES = (  # channel, weight, peak, and widths below and above it in nm
    (0, 1.056, 599.8, 37.9, 31.0), (0, 0.362, 442.0, 16.0, 26.7), (0, -0.065, 501.1, 20.4, 26.2),
    (1, 0.821, 568.8, 46.9, 40.5), (1, 0.286, 530.9, 16.3, 31.1),
    (2, 1.217, 437.0, 11.8, 36.0), (2, 0.681, 459.0, 26.0, 13.8),
)  # fmt: skip


def black_body(kelvin: float) -> RGB:
    """Linear Rec.709 colour of a black body, of luminance one; blue below 1,900 K is zero.

    Planck's law over the colour-matching functions of Wyman, Sloan and Shirley 2013.
    """
    length = np.arange(380.0, 781.0)
    spectrum = length**-5 / np.expm1(RADIATION / (length * 1e-9 * kelvin))
    xyz = np.zeros(3)
    for channel, weight, peak, below, above in LOBES:
        width = np.where(length < peak, below, above)
        xyz[channel] += weight * (spectrum * np.exp(-0.5 * ((length - peak) / width) ** 2)).sum()
    color = np.maximum(TO_REC709 @ xyz, 0)
    r, g, b = (color / (LUMINANCE @ color)).tolist()
    return r, g, b


def radiance(lumens: float, kelvin: float, area: float) -> RGB:
    """Radiance in W/(m² sr) of a surface of `area` in m² that sends out so much light evenly."""
    level = lumens / (LUMENS_PER_WATT * np.pi * area)
    r, g, b = (float(level * c) for c in black_body(kelvin))
    return r, g, b
