"""The head of a PNG picture: what it would unpack to, before anything unpacks it."""

from __future__ import annotations

import struct
from collections.abc import Iterator

from purelight_format.issues import Issue, issue
from purelight_format.limits import Limits

HEAD = struct.Struct(">16s2I5B")
START = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"


def check(data: bytes, where: str, limits: Limits) -> Iterator[Issue]:
    """Checks signature and size; the picture itself is for viewers, which have their own care."""
    if len(data) < HEAD.size or not data.startswith(START):
        yield issue("PLX_PREVIEW_INVALID", where)
        return
    _, width, height, *_ = HEAD.unpack_from(data)
    if not (0 < width <= limits.picture_pixels and 0 < height <= limits.picture_pixels):
        size, limit = f"{width} x {height}", limits.picture_pixels
        yield issue("PLX_PREVIEW_TOO_LARGE", where, size=size, limit=limit)
