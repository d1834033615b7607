"""Which reader takes a file."""

from __future__ import annotations

import re
import struct
from pathlib import Path

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError
from purelight_import.model.lamp import Lamp
from purelight_import.read import isolated

HEAD = 4096
READERS = {
    ".glb": "glTF", ".gltf": "glTF", ".obj": "OBJ", ".usd": "USD", ".usda": "USD", ".usdc": "USD",
    ".usdz": "USD", ".xml": "Mitsuba",
}  # fmt: skip
BROKEN = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError, RecursionError,
          struct.error, MemoryError)  # fmt: skip
VERSION = re.compile(rb"<scene\b[^>]*?\bversion\s*=\s*[\"'](\d+)")
POINTER = b"version https://git-lfs.github.com/spec/"
LISTED = "glTF (.glb, .gltf), OBJ (.obj), USD (.usda, .usdc, .usd, .usdz) or Mitsuba (.xml)"


def format_of(path: Path) -> str:
    """The name of a file's format.

    Raises:
        PureLightError: it is missing, of none that is read, or stands for a file elsewhere.
    """
    kind = READERS.get(path.suffix.lower())
    if not files.is_file(path):
        raise PureLightError(f"{path}: no such file; give a lamp as {LISTED}")
    if kind is None:
        raise PureLightError(f"{path}: '{path.suffix}' is not read; give a lamp as {LISTED}")
    head = _head(path)
    if not head:
        raise PureLightError(f"{path}: the file is empty")
    if head.startswith(POINTER):
        raise PureLightError(f"{path}: a pointer of Git LFS, not the lamp; run git lfs pull")
    return kind


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEAD)
    except OSError as error:
        raise PureLightError(f"{path}: cannot read: {error.strerror}") from None


def is_mitsuba_3(path: Path) -> bool:
    """Whether a file is a scene that Mitsuba 3 loads as it is; broken ones are left to Mitsuba."""
    if path.suffix.lower() != ".xml":
        return False
    if not files.is_file(path):
        return True
    with path.open("rb") as file:
        found = VERSION.search(file.read(16 * HEAD))
    return found is None or int(found[1]) >= 2


def read(path: Path) -> Lamp:
    """Reads a lamp, in the units and axes of its file.

    Raises:
        PureLightError: it cannot be taken.
    """
    kind = format_of(path)
    try:
        if kind == "glTF":
            from purelight_import.read.gltf import read_gltf

            lamp = read_gltf(path)
        elif kind == "OBJ":
            from purelight_import.read.obj import read_obj

            lamp = read_obj(path)
        elif kind == "USD":
            lamp = isolated.call("purelight_import.read.usd:read_usd", path)
        else:
            lamp = isolated.call("purelight_import.read.mitsuba3:read_mitsuba", path)
    except FormatError as error:  # The only one here is that a file is too large.
        raise PureLightError(f"{path}: {error}") from None
    except PureLightError as error:
        raise PureLightError(_placed(path, str(error))) from None
    except BROKEN as error:
        reason = " ".join(str(error).split())[-300:] or type(error).__name__
        raise PureLightError(f"{path}: broken or no {kind}: {reason}") from None
    if not lamp.parts and not lamp.points:
        raise PureLightError(f"{path}: holds no mesh and no light that can be taken")
    return lamp


def _placed(path: Path, text: str) -> str:
    return text if text.startswith(str(path)) else f"{path}: {text}"
