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
