"""The files that a Mitsuba scene is made of."""

from __future__ import annotations

import hashlib
import os
import re
from html import unescape
from pathlib import Path

SPELLED = re.compile(r"""=\s*(?:"([^"<]*)"|'([^'<]*)')""")


def scene_digest(path: Path) -> str:
    """SHA-256 over a scene file and every other file that it names, in name order."""
    digest = hashlib.sha256(path.read_bytes())
    for file in sorted(scene_files(path), key=lambda file: (file.name, file)):
        digest.update(file.name.encode() + b"\0" + file.read_bytes())
    return digest.hexdigest()


def scene_files(path: Path) -> set[Path]:
    """The files that a scene names, wherever they lie, and those of the scenes that it includes.

    Every attribute of the XML counts that leads to a file from the scene's folder, or from a folder
    that another attribute leads to: Mitsuba looks for files in the folders of `<path>` too.
    """
    named = _named(path, path.parent)
    waiting = [file for file in named if file.suffix.lower() == ".xml"]
    while waiting:
        found = _named(waiting.pop(), path.parent) - named
        named |= found
        waiting += [file for file in found if file.suffix.lower() == ".xml"]
    return named - {Path(os.path.abspath(path))}


def _named(path: Path, folder: Path) -> set[Path]:
    """Files that the attributes of a scene file lead to."""
    text = path.read_text(errors="replace")
    spelled = {unescape(double or single) for double, single in SPELLED.findall(text)} - {""}
    folders = [folder, path.parent]
    folders += [folder / name for name in spelled if os.path.isdir(folder / name)]
    places = (os.path.abspath(place / name) for place in folders for name in spelled)
    return {Path(place) for place in places if os.path.isfile(place)}
