"""Pictures as files: linear OpenEXR, and a tone-mapped PNG preview."""

from __future__ import annotations

import io
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from purelight_format import atomic
from purelight_format.color import LUMINANCE


def write_exr(
    path: Path,
    image: np.ndarray,
    *,
    half: bool = False,
    layers: Mapping[str, np.ndarray] | None = None,
) -> None:
    """Writes a linear picture [H, W, 3] and further layers; half floats stop at 65,504.

    Arguments:
        layers: By name, [H, W, 3] or [H, W, 1]; `normal` has the channels X, Y and Z, one channel
            alone is called Z, and all others are RGB.
    """
    pixels = image.clip(-65504, 65504).astype(np.float16) if half else image.astype(np.float32)
    channels = {"RGB": np.ascontiguousarray(pixels)}
    for name, layer in (layers or {}).items():
        letters = {"normal": "XYZ"}.get(name, "RGB") if layer.shape[-1] == 3 else "Z"
        for index, letter in enumerate(letters):
            channels[f"{name}.{letter}"] = np.ascontiguousarray(layer[..., index], np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with tempfile.TemporaryDirectory() as folder:
        draft = Path(folder) / "image.exr"
        with OpenEXR.File(header, channels) as file:
            file.write(str(draft))
        atomic.write_bytes(path, draft.read_bytes())


def exposure(image: np.ndarray) -> float:
    """Stops that bring the brightest hundredth of the lit pixels to white."""
    luminance = image @ LUMINANCE
    lit = luminance[luminance > 0]
    return float(-np.log2(np.percentile(lit, 99))) if lit.size else 0.0


def png(image: np.ndarray, stops: float | None = None) -> bytes:
    """Encodes `1 - exp(-1.5 L 2^stops)` as sRGB, so that highlights keep their colour longer."""
    gain = 2.0 ** (exposure(image) if stops is None else stops)
    mapped = 1 - np.exp(-1.5 * gain * np.maximum(image.astype(np.float64), 0))
    encoded = np.where(mapped < 0.0031308, 12.92 * mapped, 1.055 * mapped ** (1 / 2.4) - 0.055)
    buffer = io.BytesIO()
    Image.fromarray(np.rint(255 * encoded).astype(np.uint8)).save(buffer, "PNG")
    return buffer.getvalue()
