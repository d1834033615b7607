"""What a lamp is made from: its file, and the files that it names."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from urllib.parse import unquote_to_bytes

from purelight_format.errors import PureLightError

BLOCK = 1 << 20
NAMING = (".mtl", ".xml", ".usda", ".usd", ".usdc", ".gltf", ".glb", ".obj")  # Of other files
JSON = (".gltf", ".glb")
CRATE = b"PXR-USDC"  # How binary USD begins, whose names are compressed
UNQUOTED = re.compile(rb"""[^"'@<>|\r\n\0]+""")  # What a file's name may be part of
SUFFIX, LONGEST = re.compile(rb"\.[A-Za-z]"), 1024


def input_digest(path: Path) -> str:
    """SHA-256 over a lamp's file and every file that one of them names.

    A name counts wherever it occurs, as it is or as the format writes it: in XML, in glTF, in OBJ's
    MTL, in USD. In the lamp's folder the name alone is enough, and links are not followed; files of
    other folders are found by their paths.

    Raises:
        PureLightError: there is no such file.
    """
    if not path.is_file():
        raise PureLightError(f"{path}: no such file")
    path = Path(os.path.abspath(path))
    beside = {p for p in path.parent.rglob("*") if p.is_file() and not p.is_symlink()} - {path}
    named, waiting = {path}, [path]
    while waiting:
        file = waiting.pop()
        found = (_named(file, beside - named) | _elsewhere(file)) - named
        named |= found
        waiting += [p for p in found if p.suffix.lower() in NAMING]
    digest = hashlib.sha256()
    for label, content in sorted((_label(file, path.parent), _digest(file)) for file in named):
        digest.update(os.fsencode(label) + b"\0" + content)
    return digest.hexdigest()


def _label(file: Path, folder: Path) -> str:
    """A file's place in the lamp's folder; elsewhere its name, as the lamp may have been moved."""
    return str(file.relative_to(folder)) if file.is_relative_to(folder) else file.name


def _named(path: Path, others: set[Path]) -> set[Path]:
    """Those of other files that a file names."""
    data = path.read_bytes()
    if data.startswith(CRATE):
        return _named_in_crate(path, others)
    spelled: dict[bytes, set[Path]] = {}
    for other in others:
        for name in (os.fsencode(other.name), _quoted(other, path)):
            spelled.setdefault(name, set()).add(other)
    found: set[Path] = set()
    for text in _readings(path, data):
        for name in _occurring(set(spelled), text):
            found |= spelled[name]
    return found


def _occurring(names: set[bytes], text: bytes) -> Iterator[bytes]:
    """Those of many names that occur in a text, looked for by their few endings."""
    lengths: dict[bytes, set[int]] = {}
    for name in names:
        stem, dot, ending = name.rpartition(b".")
        lengths.setdefault(dot + ending if stem else name, set()).add(len(name))
    for ending, sizes in lengths.items():
        end = text.find(ending)
        while end >= 0:
            end += len(ending)
            yield from (part for size in sizes if (part := text[max(end - size, 0) : end]) in names)
            end = text.find(ending, end - len(ending) + 1)


def _elsewhere(path: Path) -> set[Path]:
    """Files that the paths in a file lead to."""
    data = path.read_bytes()
    texts = _readings(path, data)
    if data.startswith(CRATE):
        texts = iter(["\n".join(_crate_names(path) or ()).encode()])
    spelled = {
        ending for text in texts for token in UNQUOTED.findall(text)
        if len(token) <= LONGEST and SUFFIX.search(token) for ending in _endings(token)
    }  # fmt: skip
    places = (os.path.normpath(path.parent / name) for name in spelled)
    return {Path(place) for place in places if os.path.isfile(place)}


def _endings(token: bytes) -> Iterator[str]:
    """A line from each of its words on: names may have blanks in them, and options before them."""
    words = token.decode("utf-8", "replace").replace("\\", "/").split()
    for first in range(len(words)):
        yield " ".join(words[first:])


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
        return os.fsencode(other.name)
    return json.dumps(other.name)[1:-1].encode()


def _named_in_crate(path: Path, others: set[Path]) -> set[Path]:
    """Those of other files that a layer of binary USD names; all, where nobody can read it."""
    found = _crate_names(path)
    if found is None:
        return set(others)
    names = "\n".join(found)
    return {p for p in others if p.name in names}


def _crate_names(path: Path) -> list[str] | None:
    """The names of files in a layer of binary USD; None, where nobody can read it."""
    try:
        from pxr import Tf, UsdUtils
    except ImportError:
        return None
    try:
        lists = UsdUtils.ExtractExternalReferences(str(path))
    except Tf.ErrorException:
        return None  # Training will say what is wrong with it
    return [name for names in lists for name in names]


def _digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(BLOCK):
            digest.update(block)
    return digest.digest()
