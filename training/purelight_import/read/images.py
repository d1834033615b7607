"""Pictures from files, decoded within bounds."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.picture import Picture

FORMATS = ("PNG", "JPEG", "WEBP", "TGA", "BMP", "TIFF", "GIF")


def decode(name: str, data: bytes, *, srgb: bool) -> Picture:
    """A picture from the bytes of its file.

    Raises:
        PureLightError: it cannot be decoded, or is too large.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            image: Image.Image = Image.open(io.BytesIO(data), formats=FORMATS)
            if image.width * image.height > limits.PICTURE_PIXELS:
                size = f"{image.width} x {image.height}"
                raise PureLightError(f"picture {name} of {size} pixels is too large")
            if image.mode in ("I;16", "I", "F", "I;16B"):
                values = np.asarray(image, np.float64)
                top = 65535 if values.max(initial=0) > 255 else 255
                image = Image.fromarray(np.uint8(np.clip(values * (255 / top), 0, 255)))
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            grey = image.mode in ("1", "L", "LA")
            image = image.convert("L" if grey and not has_alpha else "RGBA" if has_alpha else "RGB")
            image.thumbnail((limits.LARGEST_PICTURE,) * 2)
            pixels = np.atleast_3d(np.asarray(image))
    except PureLightError:
        raise
    except Exception as error:  # Decoders raise whatever they like about broken files.
        raise PureLightError(f"picture {name} cannot be decoded: {error}") from None
    return Picture(name, pixels, srgb)


def load(path: Path, *, srgb: bool) -> Picture:
    """A picture from a file; its name is the file's.

    Raises:
        PureLightError: it cannot be read.
    """
    return decode(path.stem, files.read_file(path, limits.PICTURE_BYTES), srgb=srgb)
