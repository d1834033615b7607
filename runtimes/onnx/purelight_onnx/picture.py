"""Pictures as linear OpenEXR files."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenEXR

from purelight_format import atomic


def write_exr(
    path: Path,
    image: np.ndarray,
    *,
    half: bool = False,
    layers: Mapping[str, np.ndarray] | None = None,
    alpha: np.ndarray | None = None,
) -> None:
    """Writes a linear picture [H, W, 3] and further layers; half floats stop at 65,504.

    Arguments:
        layers: By name, [H, W, 3] or [H, W, 1]; `normal` has the channels X, Y and Z, one channel
            alone is called Z, and all others are RGB.
        alpha: Coverage, [H, W, 1].
    """
    if alpha is not None:
        image = np.concatenate([image, alpha], -1)
    pixels = image.clip(-65504, 65504).astype(np.float16) if half else image.astype(np.float32)
    channels = {"RGB" if alpha is None else "RGBA": np.ascontiguousarray(pixels)}
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
