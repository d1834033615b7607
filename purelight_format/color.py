"""Linear Rec.709, the one colour space of the format."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

LUMENS_PER_WATT = 683.0  # Of luminance: a watt of light at 555 nm.

# Weights of R, G and B in the luminance (ITU-R BT.709, item 3.2): [3]
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def lumens(flux: Sequence[float] | np.ndarray) -> float:
    """Luminous flux of W per channel [3].

    >>> round(lumens([1.0, 1.0, 1.0]))
    683
    """
    return float(LUMENS_PER_WATT * np.asarray(flux, np.float64) @ LUMINANCE)


def lumens_words(value: float) -> str:
    """Luminous flux for people: four digits, and no powers of ten while it is a lamp's.

    >>> lumens_words(2.65), lumens_words(1607.2), lumens_words(4357912.0)
    ('2.65 lm', '1,607 lm', '4,358,000 lm')
    """
    rounded = float(f"{value:.4g}")
    return f"{rounded:,.0f} lm" if 1000 <= abs(rounded) < 1e12 else f"{rounded:.4g} lm"
