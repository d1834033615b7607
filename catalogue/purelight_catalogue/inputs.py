"""What a lamp is made from: its file, and the files beside it that it names."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from urllib.parse import unquote_to_bytes

from purelight_format.errors import PureLightError

BLOCK = 1 << 20
NAMING = (".mtl", ".xml", ".usda", ".usd", ".usdc", ".gltf", ".glb", ".obj")  # Of other files
JSON = (".gltf", ".glb")
CRATE = b"PXR-USDC"  # How binary USD begins, whose names are compressed


def input_digest(path: Path) -> str:
    """SHA-256 over a lamp's file and every file in its folder that one of them names.

    A name counts wherever it occurs, as it is or as the format writes it: in XML, in glTF, in OBJ's
    MTL, in USD. Links are not followed.

    Raises:
        PureLightError: there is no such file.
    """
    if not path.is_file():
        raise PureLightError(f"{path}: no such file")
    beside = {p for p in path.parent.rglob("*") if p.is_file() and not p.is_symlink()} - {path}
    named, waiting = {path}, [path]
    while waiting:
        found = _named(waiting.pop(), beside - named)
        named |= found
        waiting += [p for p in found if p.suffix.lower() in NAMING]
    digest = hashlib.sha256()
    for file in sorted(named):
        digest.update(str(file.relative_to(path.parent)).encode() + b"\0")
        digest.update(_digest(file))
    return digest.hexdigest()


def _named(path: Path, others: set[Path]) -> set[Path]:
    """Those of other files that a file names."""
    data = path.read_bytes()
    if data.startswith(CRATE):
        return _named_in_crate(path, others)
    found: set[Path] = set()
    for text in _readings(path, data):
        found |= {p for p in others - found if p.name.encode() in text or _quoted(p, path) in text}
    return found


def _readings(path: Path, data: bytes) -> Iterator[bytes]:
    """A file's bytes, and what they mean where names are escaped in it."""
    yield data
    if b"%" in data:  # In addresses
        yield unquote_to_bytes(data)
    if path.suffix.lower() == ".xml" and b"&" in data:
        yield unescape(data.decode("utf-8", "replace")).encode()


def _quoted(other: Path, path: Path) -> bytes:
    """Another file's name as JSON has it, in a file that is JSON."""
    if path.suffix.lower() not in JSON:
        return other.name.encode()
    return json.dumps(other.name)[1:-1].encode()


def _named_in_crate(path: Path, others: set[Path]) -> set[Path]:
    """Those of other files that a layer of binary USD names; all, where nobody can read it."""
    try:
        from pxr import Tf, UsdUtils
    except ImportError:
        return set(others)
    try:
        lists = UsdUtils.ExtractExternalReferences(str(path))
    except Tf.ErrorException:
        return set(others)  # Training will say what is wrong with it
    names = "\n".join(name for names in lists for name in names)
    return {p for p in others if p.name in names}


def _digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.digest()
