"""Mesh files that a Mitsuba scene names, checked before Mitsuba makes room for what they claim."""

from __future__ import annotations

import struct
import xml.etree.ElementTree as ET
import zlib
from pathlib import Path

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits

HEADER = 1 << 16
SERIALIZED = 0x041C


def check(shape: ET.Element) -> None:
    """Refuses a mesh file that is too large, or whose header claims what it cannot hold.

    Raises:
        PureLightError: it is.
        ValueError: the file is broken.
    """
    for string in shape.findall("string"):
        if string.get("name") == "filename":
            path = Path(string.get("value", ""))
            size = path.stat().st_size
            if size > limits.FILE_BYTES:
                raise PureLightError(f"{path.name}: {size:,} bytes are too many to read")
            if shape.get("type") == "ply":
                _ply(path, size)
            elif shape.get("type") == "serialized":
                _serialized(path)


def _ply(path: Path, size: int) -> None:
    """A vertex or face takes at least two bytes."""
    with path.open("rb") as file:
        head = file.read(HEADER).partition(b"end_header")[0].decode("latin-1")
    for line in head.splitlines():
        words = line.split()
        if words[:1] == ["element"] and len(words) == 3 and int(words[2]) > size // 2:
            raise ValueError(f"{path.name} claims {words[2]} of {words[1][:20]}, and ends before")


def _serialized(path: Path) -> None:
    """Counts of the first mesh, which is compressed."""
    data = files.read_file(path, limits.FILE_BYTES)
    if len(data) < 4 or struct.unpack_from("<H", data)[0] != SERIALIZED:
        raise ValueError(f"{path.name} is no serialized mesh")
    version = struct.unpack_from("<H", data, 2)[0]
    try:
        head = zlib.decompressobj().decompress(data[4:HEADER], 4096)
    except zlib.error as error:
        raise ValueError(f"{path.name} is broken: {error}") from None
    at = 4
    if version >= 4:
        at = head.index(b"\0", 4) + 1
    vertices, triangles = struct.unpack_from("<QQ", head, at)
    if max(vertices, triangles) > limits.VERTICES:
        raise PureLightError(f"{path.name} has too many triangles; decimate it")
