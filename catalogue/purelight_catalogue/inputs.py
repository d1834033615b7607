"""What a lamp is made from: its file, and the files beside it that it names."""

from __future__ import annotations

import hashlib
from pathlib import Path

from purelight_format.errors import PureLightError

BLOCK = 1 << 20


def input_digest(path: Path) -> str:
    """SHA-256 over a lamp's file and every file in its folder that one of them names.

    A name counts wherever its bytes occur: in XML, in glTF, in OBJ's MTL, in binary USD. Links are
    not followed.

    Raises:
        PureLightError: there is no such file.
    """
    if not path.is_file():
        raise PureLightError(f"{path}: no such file")
    beside = {p for p in path.parent.rglob("*") if p.is_file() and not p.is_symlink()} - {path}
    named, waiting = {path}, [path]
    while waiting:
        text = waiting.pop().read_bytes()
        found = {p for p in beside - named if p.name.encode() in text}
        named |= found
        waiting += [p for p in found if p.suffix.lower() in (".mtl", ".xml", ".usda", ".usd")]
    digest = hashlib.sha256()
    for file in sorted(named):
        digest.update(str(file.relative_to(path.parent)).encode() + b"\0")
        digest.update(_digest(file))
    return digest.hexdigest()


def _digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.digest()
