"""Pictures from files, decoded within bounds."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.picture import Picture
from purelight_import.read import high_range

KINDS = "PNG, JPEG, WebP, TGA, OpenEXR, HDR or PFM"
FORMATS = ("PNG", "JPEG", "WEBP", "TGA", "BMP", "TIFF", "GIF")


def decode(name: str, data: bytes, *, srgb: bool) -> Picture:
    """A picture from the bytes of its file.

    Raises:
        PureLightError: it cannot be decoded, or is too large.
    """
    from PIL import Image, UnidentifiedImageError

    try:
        if high_range.suffix_of(data):
            _check(*high_range.size(data))
            return Picture(name, _linear(high_range.decode(data)))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
            _check(image.width, image.height)
            if image.mode == "F":
                return Picture(name, _linear(np.asarray(image, np.float32)[..., None]))
            if image.mode in ("I;16", "I", "I;16B"):
                values = np.asarray(image, np.float64)
                top = 255 if image.mode == "I" and values.max(initial=0) <= 255 else 65535
                image = Image.fromarray(np.uint8(np.clip(values * (255 / top), 0, 255)))
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            grey = image.mode in ("1", "L", "LA")
            image = image.convert("L" if grey and not has_alpha else "RGBA" if has_alpha else "RGB")
            image.thumbnail((limits.LARGEST_PICTURE,) * 2)
            pixels = np.atleast_3d(np.asarray(image))
    except UnidentifiedImageError:
        raise PureLightError(f"picture {name} cannot be decoded: give it as {KINDS}") from None
    except Exception as error:  # Decoders raise whatever they like about broken files.
        raise PureLightError(f"picture {name} cannot be decoded: {error}") from None
    return Picture(name, pixels, srgb)


def _check(width: int, height: int) -> None:
    if min(width, height) < 1 or width * height > limits.PICTURE_PIXELS:
        raise PureLightError(f"{width} x {height} pixels are too many or none")


def _linear(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear values [H, W, C], none of them negative, of a picture whose sides are not too long."""
    from PIL import Image

    if not np.isfinite(pixels).all():
        raise PureLightError("it has values that are no numbers")
    pixels = np.maximum(pixels, 0)
    height, width = pixels.shape[:2]
    factor = limits.LARGEST_PICTURE / max(height, width)
    if factor >= 1:
        return pixels
    size = max(round(factor * width), 1), max(round(factor * height), 1)
    layers = [Image.fromarray(pixels[..., k]) for k in range(pixels.shape[2])]
    return np.stack([np.asarray(x.resize(size, Image.Resampling.BOX)) for x in layers], -1)


def load(path: Path, *, srgb: bool) -> Picture:
    """A picture from a file; its name is the file's.

    Raises:
        PureLightError: it cannot be read.
    """
    return decode(path.stem, files.read_file(path, limits.PICTURE_BYTES), srgb=srgb)
