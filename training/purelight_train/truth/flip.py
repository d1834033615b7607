"""FLIP: the difference of two pictures that an eye notices when it flips between them.

HDR-FLIP by the authors' own library: Andersson et al., "FLIP: A Difference Evaluator for
Alternating Images" (HPG 2020) and "Visualizing Errors in Rendered High Dynamic Range Images"
(Eurographics 2021).
"""

from __future__ import annotations

import math

import numpy as np
from flip_evaluator import evaluate
from numpy.typing import NDArray

Image = NDArray[np.float64]

LUMINANCE = (2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897)  # As the library has it.
# The ACES curve of Narkowicz with the usual 0.6 ahead of it: (a x² + b x) / (c x² + d x + e)
TONE = (0.6**2 * 2.51, 0.6 * 0.03, 0.6**2 * 2.43, 0.6 * 0.59, 0.14)
TONE_WHITE = 0.85
GLARE = 1e6  # Far beyond what the curve shows as white; its square is finite in float32.


def hdr_flip(image: Image, reference: Image, mask: NDArray[np.bool_] | None = None) -> float:
    """Mean HDR-FLIP over the pixels of a mask [H, W], or over all: 0 alike .. 1.

    Exposures follow from the reference's luminance over the same pixels, so that the black around
    a lamp does not count as its typical brightness. The screen is 0.7 m wide and 0.7 m away. A
    picture with pixels that are not numbers gives none.
    """
    chosen = np.ones(image.shape[:2], bool) if mask is None else mask
    if not (np.isfinite(image).all() and np.isfinite(reference).all()):
        return math.nan
    first, stops = exposures(reference[chosen])
    shown = [np.clip(x * 2.0**first, 0, GLARE).astype(np.float32) for x in (reference, image)]
    count = max(2, math.ceil(stops))
    # The library ends the process where the last exposure is no larger than the first.
    settings = {"startExposure": 0.0, "stopExposure": max(stops, 1e-3), "numExposures": count}
    pixels, _, _ = evaluate(*shown, "HDR", applyMagma=False, parameters=settings)
    return float(pixels[..., 0][chosen].mean(dtype=np.float64))


def exposures(reference: Image) -> tuple[float, float]:
    """Stops to what shows the brightest pixel as white, and from there to the median one.

    Arguments:
        reference: linear RGB [..., 3].
    """
    luminance = np.maximum(reference, 0).reshape(-1, 3) @ LUMINANCE
    top, median = (max(float(x), 1e-30) for x in (luminance.max(), np.median(luminance)))
    a, b, c, d, e = TONE
    a, b, e = a - TONE_WHITE * c, b - TONE_WHITE * d, -TONE_WHITE * e
    white = (-b + math.sqrt(b * b - 4 * a * e)) / (2 * a)  # is shown as TONE_WHITE
    return math.log2(white / top), math.log2(top / max(median, 1e-6 * top))
