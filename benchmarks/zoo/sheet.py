"""Contact sheets: truth, ours and their difference side by side, and all lamps of a zoo."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from purelight_format import atomic
from purelight_format.color import LUMINANCE
from purelight_format.srgb import png

Picture = NDArray[np.float64]
Pixels = NDArray[np.uint8]
WIDE = 7  # lamps in a row
WHITE_ERROR = 0.5  # relative error that is shown at full strength


def strip(truth: Picture, ours: Picture, mask: NDArray[np.bool_], white: float | None = None
          ) -> Pixels:  # fmt: skip
    """Truth, ours, and the relative difference: red where ours is brighter, blue where darker.

    Arguments:
        white: radiance shown as white (default: by the truth's brightest pixels of the mask).
    """
    level = white or _exposure(truth[mask])
    lit = [_shown(np.where(mask[..., None], p, 0) / level) for p in (truth, ours)]
    return np.concatenate((*lit, _difference(truth, ours, mask)), 1)


def _exposure(pixels: Picture) -> float:
    bright = float(np.percentile(pixels @ LUMINANCE, 97)) if pixels.size else 0.0
    return bright or 1.0


def _shown(image: Picture) -> Pixels:
    with Image.open(io.BytesIO(png(image, 0.0))) as picture:
        return np.array(picture)


def _difference(truth: Picture, ours: Picture, mask: NDArray[np.bool_]) -> Pixels:
    """Luminance apart, over the truth's and a tenth of its mean."""
    told, true = ours @ LUMINANCE, truth @ LUMINANCE
    floor = 0.1 * true[mask].mean() if mask.any() else 0.0
    apart = np.where(mask, (told - true) / np.maximum(true + floor, 1e-30), 0)
    strength = np.clip(apart / WHITE_ERROR, -1, 1)
    colour = np.stack((strength, 0.3 * np.abs(strength), -strength), -1)
    return (255 * np.clip(colour, 0, 1)).astype(np.uint8)


def save(path: Path, rows: list[Pixels]) -> None:
    """Write rows of one width as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(np.concatenate(rows)).save(buffer, "PNG")
    atomic.write_bytes(path, buffer.getvalue())


def stacked(path: Path, files: list[Path]) -> None:
    """Write pictures below each other, those that exist; narrower ones have black beside them."""
    rows = [np.array(Image.open(file).convert("RGB")) for file in files if file.is_file()]
    if not rows:
        return
    width = max(row.shape[1] for row in rows)
    save(path, [np.pad(row, ((0, 4), (0, width - row.shape[1]), (0, 0))) for row in rows])


def gallery(path: Path, portraits: dict[str, Path]) -> None:
    """Write the portraits of lamps by name, row by row."""
    tiles = []
    for name, file in portraits.items():
        with Image.open(file) as picture:
            tile = picture.convert("RGB")
        ImageDraw.Draw(tile).text((3, 2), name, fill=(200, 0, 0))
        tiles.append(np.array(tile))
    while len(tiles) % WIDE:
        tiles.append(np.zeros_like(tiles[0]))
    rows = [np.concatenate(tiles[k : k + WIDE], 1) for k in range(0, len(tiles), WIDE)]
    save(path, rows)
