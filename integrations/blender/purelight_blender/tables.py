"""The texture with a lamp's tables: packed into the .blend, and as a file for OSL to read.

OSL reads textures from files alone. The file lies in a folder of the extension under the lamp's
digest; where it is missing, as on another machine, it is written anew from the packed bytes.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

from purelight_format import atomic
from purelight_format.errors import PureLightError

KEY = "purelight_tables"  # Of the image: the digest of the lamp.
DIGEST = re.compile("[0-9a-f]{64}")
EXTENSION = "bl_ext."


def folder() -> Path:
    """Where the files lie.

    Raises:
        PureLightError: If it cannot be made.
    """
    try:
        if __package__.startswith(EXTENSION):
            return Path(bpy.utils.extension_path_user(__package__, path="tables", create=True))
        return Path(bpy.utils.user_resource("DATAFILES", path="purelight", create=True))
    except (OSError, TypeError, ValueError) as error:
        raise PureLightError(f"the folder for lamps' tables cannot be made: {error}") from error


def packed(texels: np.ndarray, digest: str, name: str) -> Any:
    """An image of Blender's that holds the texture as a packed file.

    Arguments:
        texels: [rows, width, 4] float32.
        digest: of the bundle.
        name: for people.
    """
    data = _exr(texels)
    image = bpy.data.images.new(name, 1, 1, alpha=True, float_buffer=True)
    image.source, image.alpha_mode = "FILE", "CHANNEL_PACKED"
    image.colorspace_settings.name = "Non-Color"
    image.filepath_raw = f"//{digest[:16]}.exr"
    image.pack(data=data, data_len=len(data))
    image[KEY] = digest
    return image


def file_of(image: Any) -> Path:
    """The file that holds what the image holds, written if there is none.

    Raises:
        PureLightError: If the image has lost its content or its lamp's digest, or the file cannot
            be written.
    """
    digest = str(image[KEY])
    if not DIGEST.fullmatch(digest):  # A stranger's .blend must not name a place to write to.
        raise PureLightError(f"{image.name}: not the tables of a lamp; import the lamp again")
    path = folder() / f"{digest}.exr"
    held = image.packed_file
    if path.exists() and (held is None or path.stat().st_size == held.size):
        return path
    if held is None:
        raise PureLightError(f"{image.name}: the lamp's tables are lost; import the lamp again")
    atomic.write_bytes(path, held.data)
    return path


def _exr(texels: np.ndarray) -> bytes:
    import OpenImageIO

    rows, width, channels = texels.shape
    spec = OpenImageIO.ImageSpec(width, rows, channels, "float")
    spec.attribute("compression", "zip")
    with tempfile.TemporaryDirectory() as place:
        path = str(Path(place) / "tables.exr")
        output = OpenImageIO.ImageOutput.create(path)
        written = output.open(path, spec) and output.write_image(np.ascontiguousarray(texels))
        if not written or not output.close():
            raise PureLightError(f"the lamp's tables cannot be written: {output.geterror()}")
        return Path(path).read_bytes()
