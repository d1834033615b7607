"""Pictures with a high range, whose values are linear numbers: OpenEXR, Radiance and PFM files."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError

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
        Exception: they cannot be read; of whatever kind Mitsuba raises.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"picture{suffix_of(data)}"
        path.write_bytes(data)
        return _read(path)


def size(data: bytes) -> tuple[int, int]:
    """Pixels along both sides by the header, before anything is allocated for them.

    Raises:
        PureLightError: it does not say.
    """
    suffix = suffix_of(data)
    found = SIZES[suffix].search(data[:HEADER])
    if found is None:
        raise PureLightError("it does not say its size")
    if suffix == ".exr":
        low, high = np.frombuffer(found[1], "<i4").astype(np.int64).reshape(2, 2)
        width, height = (high - low + 1).tolist()
        return width, height
    return int(found[1]), int(found[2])


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
