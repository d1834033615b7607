"""Linear Rec.709 as sRGB, for screens: the transfer curve, and PNG previews."""

from __future__ import annotations

import io

import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError


def encode(linear: np.ndarray) -> np.ndarray:
    """The transfer curve of IEC 61966-2-1: linear [...] in [0, 1] -> [...] in [0, 1]."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def decode(code: np.ndarray) -> np.ndarray:
    """Inverse of `encode`."""
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def exposure(image: np.ndarray) -> float:
    """Stops that bring the brightest hundredth of the lit pixels to white."""
    luminance = image @ LUMINANCE
    lit = luminance[luminance > 0]
    return float(-np.log2(np.percentile(lit, 99))) if lit.size else 0.0


def tone(image: np.ndarray, stops: float) -> np.ndarray:
    """`1 - exp(-1.5 L 2^stops)`, in 0 .. 1, so that highlights keep their colour longer."""
    return 1 - np.exp(-1.5 * 2.0**stops * np.maximum(image.astype(np.float64), 0))


def png(image: np.ndarray, stops: float | None = None) -> bytes:
    """Encodes the toned picture as sRGB."""
    return plain_png(tone(image, exposure(image) if stops is None else stops))


def plain_png(image: np.ndarray) -> bytes:
    """Encodes a linear picture [H, W, 3] in [0, 1].

    Raises:
        PureLightError: If there is no Pillow.
    """
    try:
        from PIL import Image
    except ImportError as error:
        raise PureLightError('a PNG needs Pillow: pip install "purelight[onnx]"') from error
    buffer = io.BytesIO()
    Image.fromarray(np.rint(255 * encode(image)).astype(np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()
