"""The constants and the exit surface of a lamp as files of plain numbers, little-endian."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_shader.form.elements import Kind
from purelight_shader.form.store import FOUR, Store
from purelight_shader.targets.slang_module import TEXTURE_WIDTH

TEXTURE_ROWS = 8192  # Of the largest texture that most GPUs have.
FILES = ((Kind.FLOAT, "floats.bin", "<f4"), (Kind.INT, "integers.bin", "<i4"))


def constants(store: Store, *, textures: bool) -> Iterator[tuple[str, bytes]]:
    """The buffers of a store; those of no elements are left out.

    Arguments:
        textures: whether they are filled up to whole rows of a texture.

    Raises:
        PureLightError: If a texture cannot hold them.
    """
    for kind, name, dtype in FILES:
        fours = store.size(kind) // FOUR
        if not fours:
            continue
        data = store.buffer(kind).astype(dtype)
        if textures:
            rows = -(-fours // TEXTURE_WIDTH)
            if rows > TEXTURE_ROWS:
                raise PureLightError(
                    f"the networks' tables take {rows:,} rows of a texture, and GPUs have "
                    f"{TEXTURE_ROWS:,}; train a smaller lamp (purelight-size)"
                )
            data = np.pad(data, ((0, rows * TEXTURE_WIDTH - fours), (0, 0)))
        yield name, data.tobytes()


def surface(bundle: Bundle) -> Iterator[tuple[str, bytes]]:
    """The exit surface."""
    found = bundle.surface()
    yield "surface_positions.bin", found.positions.astype("<f4").tobytes()
    yield "surface_triangles.bin", found.triangles.astype("<u4").tobytes()
    yield "surface_flux.bin", found.triangle_flux.astype("<f4").tobytes()
