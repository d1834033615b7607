"""Pictures with a high range, whose values are linear numbers: OpenEXR, Radiance and PFM files."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_import.model import limits

SIGNS = {b"\x76\x2f\x31\x01": ".exr", b"#?": ".hdr", b"PF": ".pfm", b"Pf": ".pfm"}
HEADER = 1 << 16  # bytes in which the size is said
SIZES = {
    ".hdr": re.compile(rb"\n[-+][XY] +(\d+) +[-+][XY] +(\d+)"),
    ".pfm": re.compile(rb"P[Ff]\s+(\d+)\s+(\d+)"),
    ".exr": re.compile(rb"dataWindow\0box2i\0\x10\0\0\0(.{16})", re.DOTALL),
}


def suffix_of(data: bytes) -> str:
    """The suffix of such a file, by how it begins; "" for others."""
    return next((suffix for sign, suffix in SIGNS.items() if data.startswith(sign)), "")


def decode(data: bytes) -> NDArray[np.float32]:
    """Values of the pixels [H, W, C], of which some may be negative or no numbers.

    Raises:
        PureLightError: they are too many.
        Exception: they cannot be read; of whatever kind Mitsuba raises.
    """
    suffix = suffix_of(data)
    _check_size(data[:HEADER], suffix)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"picture{suffix}"
        path.write_bytes(data)
        return _read(path)


def _check_size(header: bytes, suffix: str) -> None:
    """Before anything is allocated for it."""
    found = SIZES[suffix].search(header)
    if found is None:
        raise PureLightError("it does not say its size")
    if suffix == ".exr":
        low, high = np.frombuffer(found[1], "<i4").astype(np.int64).reshape(2, 2)
        sides = tuple((high - low + 1).tolist())
    else:
        sides = tuple(int(side) for side in found.groups())
    if min(sides) < 1 or sides[0] * sides[1] > limits.PICTURE_PIXELS:
        raise PureLightError(f"its {sides[0]} x {sides[1]} pixels are too many or none")


def _read(path: Path) -> NDArray[np.float32]:
    from purelight_mitsuba import platform

    mi = platform.use()
    kinds = mi.Bitmap.PixelFormat
    with platform.reading():
        bitmap = mi.Bitmap(str(path))
        few = bitmap.pixel_format() in (kinds.Y, kinds.YA, kinds.RGB, kinds.RGBA)
        kind = bitmap.pixel_format() if few else kinds.RGB
        bitmap = bitmap.convert(kind, mi.Struct.Type.Float32, srgb_gamma=False)
    return np.atleast_3d(np.array(bitmap, np.float32))
