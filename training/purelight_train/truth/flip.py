"""FLIP: the difference of two pictures that an eye notices when it flips between them.

LDR-FLIP is from Andersson et al., "FLIP: A Difference Evaluator for Alternating Images" (HPG 2020);
HDR-FLIP, its greatest value over a range of exposures, from Andersson et al., "Visualizing Errors
in Rendered High Dynamic Range Images" (Eurographics 2021). All constants are theirs.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import convolve1d

Image = NDArray[np.float64]

PIXELS_PER_DEGREE = 0.7 * 3840 / 0.7 * math.pi / 180  # a 0.7 m wide screen seen from 0.7 m
WHITE = np.array([0.950428545, 1.0, 1.088900371])  # D65
TO_XYZ = np.array([
    [10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
    [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
    [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382],
])  # fmt: skip
TO_RGB = np.linalg.inv(TO_XYZ)
# Contrast sensitivity: sums of two Gaussians a sqrt(pi / b) exp(-pi² x² / b), x in degrees
SENSITIVITY = {
    "achromatic": ((1.0, 0.0047), (0.0, 1e-5)),
    "red_green": ((1.0, 0.0053), (0.0, 1e-5)),
    "blue_yellow": ((34.1, 0.04), (13.5, 0.025)),
}
FEATURE_WIDTH = 0.082  # degrees
COLOUR_POWER, COLOUR_KNEE, COLOUR_TOP, FEATURE_POWER = 0.7, 0.4, 0.95, 0.5
# The ACES curve of Narkowicz with the usual 0.6 ahead of it: (a x² + b x) / (c x² + d x + e)
TONE = (0.6**2 * 2.51, 0.6 * 0.03, 0.6**2 * 2.43, 0.6 * 0.59, 0.14)
TONE_WHITE = 0.85


def hdr_flip(
    image: Image,
    reference: Image,
    mask: NDArray[np.bool_] | None = None,
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> float:
    """Mean HDR-FLIP over the pixels of a mask [H, W], or over all: 0 alike .. 1.

    Exposures follow from the reference's luminance over the same pixels, so that the black around
    a lamp does not count as its typical brightness.
    """
    chosen = np.ones(image.shape[:2], bool) if mask is None else mask
    value = hdr_flip_map(image, reference, exposures(reference[chosen]), pixels_per_degree)
    return float(value[chosen].mean())


def hdr_flip_map(
    image: Image,
    reference: Image,
    stops: NDArray[np.float64],
    pixels_per_degree: float = PIXELS_PER_DEGREE,
) -> Image:
    """Greatest LDR-FLIP of each pixel [H, W] over exposures in stops."""
    greatest = np.zeros(image.shape[:2])
    for stop in stops:
        shown = [tone_map(np.maximum(x, 0) * 2.0**stop) for x in (image, reference)]
        greatest = np.maximum(greatest, ldr_flip_map(shown[0], shown[1], pixels_per_degree))
    return greatest


def exposures(reference: Image) -> NDArray[np.float64]:
    """Stops from that which shows the brightest pixel to that which shows the median one.

    Arguments:
        reference: linear RGB [..., 3].
    """
    luminance = np.maximum(reference, 0).reshape(-1, 3) @ TO_XYZ[1]
    top, median = (max(float(x), 1e-30) for x in (luminance.max(), np.median(luminance)))
    a, b, c, d, e = TONE
    a, b, e = a - TONE_WHITE * c, b - TONE_WHITE * d, -TONE_WHITE * e
    white = (-b + math.sqrt(b * b - 4 * a * e)) / (2 * a)  # is shown as TONE_WHITE
    first, last = math.log2(white / top), math.log2(white / max(median, 1e-6 * top))
    return np.linspace(first, last, max(2, math.ceil(last - first)))


def tone_map(radiance: Image) -> Image:
    """The tone curve of the published metric: linear RGB in 0 .. 1."""
    a, b, c, d, e = TONE
    return np.clip((a * radiance**2 + b * radiance) / (c * radiance**2 + d * radiance + e), 0, 1)


def ldr_flip_map(
    image: Image, reference: Image, pixels_per_degree: float = PIXELS_PER_DEGREE
) -> Image:
    """LDR-FLIP of each pixel [H, W] between pictures of linear RGB in 0 .. 1."""
    first, second = _opponent(image), _opponent(reference)
    colour = _colour_difference(
        _seen_colour(first, pixels_per_degree), _seen_colour(second, pixels_per_degree)
    )
    feature = _feature_difference(first[..., 0], second[..., 0], pixels_per_degree)
    return colour ** (1 - feature)


def _opponent(rgb: Image) -> Image:
    """YCxCz of linear RGB."""
    x, y, z = np.moveaxis(rgb @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack((116 * y - 16, 500 * (x - y), 200 * (y - z)), -1)


def _from_opponent(opponent: Image) -> Image:
    """Linear RGB of YCxCz."""
    y = (opponent[..., 0] + 16) / 116
    x, z = y + opponent[..., 1] / 500, y - opponent[..., 2] / 200
    return (np.stack((x, y, z), -1) * WHITE) @ TO_RGB.T


def _seen_colour(opponent: Image, pixels_per_degree: float) -> Image:
    """L*a*b* that an eye of finite sharpness sees, less colourful where dark (Hunt effect)."""
    widest = max(b for terms in SENSITIVITY.values() for _, b in terms)
    radius = math.ceil(3 * math.sqrt(widest / (2 * math.pi**2)) * pixels_per_degree)
    x = np.arange(-radius, radius + 1) / pixels_per_degree
    channels = []
    for channel, terms in zip(np.moveaxis(opponent, -1, 0), SENSITIVITY.values(), strict=True):
        kernels = [np.exp(-((math.pi * x) ** 2) / b) for _, b in terms]
        sizes = [a * math.sqrt(math.pi / b) for a, b in terms]
        total = sum(s * k.sum() ** 2 for s, k in zip(sizes, kernels, strict=True))
        channels.append(
            sum(s / total * _separable(channel, k, k) for s, k in zip(sizes, kernels, strict=True))
        )
    return _hunt(_lab(np.clip(_from_opponent(np.stack(channels, -1)), 0, 1)))


def _separable(channel: Image, rows: Image, columns: Image) -> Image:
    return convolve1d(
        convolve1d(channel, columns[::-1], axis=1, mode="nearest"), rows[::-1], 0, mode="nearest"
    )


def _lab(rgb: Image) -> Image:
    t = rgb @ TO_XYZ.T / WHITE
    delta = 6 / 29
    root = np.where(t > delta**3, np.cbrt(t), t / (3 * delta**2) + 4 / 29)
    x, y, z = np.moveaxis(root, -1, 0)
    return np.stack((116 * y - 16, 500 * (x - y), 200 * (y - z)), -1)


def _hunt(lab: Image) -> Image:
    lightness = lab[..., :1]
    return np.concatenate((lightness, 0.01 * lightness * lab[..., 1:]), -1)


def _distance(first: Image, second: Image) -> Image:
    """HyAB: city block in lightness, Euclidean in hue and chroma."""
    offset = first - second
    return np.abs(offset[..., 0]) + np.hypot(offset[..., 1], offset[..., 2])


def _colour_difference(first: Image, second: Image) -> Image:
    """HyAB to a power, with most of the range 0 .. 1 given to small differences."""
    green, blue = (_hunt(_lab(np.array(c))) for c in ([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]))
    top = _distance(green, blue) ** COLOUR_POWER
    value, knee = _distance(first, second) ** COLOUR_POWER, COLOUR_KNEE * top
    above = COLOUR_TOP + (value - knee) / (top - knee) * (1 - COLOUR_TOP)
    return np.where(value < knee, COLOUR_TOP / knee * value, above)


def _feature_difference(first: Image, second: Image, pixels_per_degree: float) -> Image:
    """Difference of edges or of points in the lightness, whichever is greater: 0 .. 1."""
    sigma = 0.5 * FEATURE_WIDTH * pixels_per_degree
    radius = math.ceil(3 * sigma)
    x = np.arange(-radius, radius + 1.0)
    gauss = np.exp(-(x**2) / (2 * sigma**2))
    differences = []
    for profile in (-x * gauss, (x**2 / sigma**2 - 1) * gauss):
        # Each two-dimensional filter's positive and negative weights sum to one and minus one
        plane = np.outer(gauss, profile)
        plus, minus = plane[plane > 0].sum(), -plane[plane < 0].sum()
        strength = [
            _strength((lightness + 16) / 116, profile, gauss, plus, minus)
            for lightness in (first, second)
        ]
        differences.append(np.abs(strength[0] - strength[1]))
    greatest = np.maximum(*differences)
    return np.clip(greatest / math.sqrt(2), 0, 1) ** FEATURE_POWER


def _strength(lightness: Image, profile: Image, gauss: Image, plus: float, minus: float) -> Image:
    """Length of a feature filter's response along x and y."""
    scaled = np.where(profile > 0, profile / plus, profile / minus)
    along_x = _separable(lightness, gauss, scaled)
    along_y = _separable(lightness, scaled, gauss)
    return np.hypot(along_x, along_y)
