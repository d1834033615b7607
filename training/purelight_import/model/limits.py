"""Upper bounds of what is read from files that may come from anyone."""

from __future__ import annotations

MIB = 1 << 20
FILE_BYTES = 1024 * MIB  # of a scene file or buffer
TEXT_BYTES = 64 * MIB  # of XML, JSON and MTL, which take many times their size in memory
PICTURE_BYTES = 128 * MIB
PICTURE_PIXELS = 8192 * 8192
LARGEST_PICTURE = 4096  # pixels along a side, to which larger ones are reduced
TRIANGLES = 10_000_000  # of the lamp, instances counted each
VERTICES = 3 * TRIANGLES
COORDINATE = 1e12  # units and metres, beyond which volumes are too large for float32
NODES = 100_000
PARTS = 20_000
DEPTH = 256  # of a hierarchy
NAME = 80  # characters of a part's name
MANY_PARTS = 400  # from which on parts of one material become one
