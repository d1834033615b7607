"""Parts that an import kept apart: a scene that rooms may include, wherever the lamp hangs."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from pathlib import Path

from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_import.write.folder import KEPT, read_record

PLACE = "lamp_at"  # Parameter of the fragment: the lamp's to_world, as 16 numbers.
IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"


def kept_beside(scene: Path) -> Path | None:
    """The scene of the parts that were kept apart when a lamp's scene was imported, if any."""
    record = read_record(scene.parent)
    if record is None or record.get("scene") != scene.name or not record.get("kept"):
        return None
    found = scene.parent / KEPT
    return found if found.is_file() else None


def copied(scene: Path, folder: Path) -> Path:
    """Copies a scene of an import, with the files that it names, into a folder; gives the copy."""
    for name in _files(_parsed(scene), scene.parent):
        _copy(scene.parent / name, folder / name)
    _copy(scene, folder / scene.name)
    return folder / scene.name


def write_fragment(scene: Path, path: Path) -> Path:
    """Writes a scene of kept parts as a fragment, and beside it a folder of the files it names.

    Its shapes stand where a lamp does whose `to_world` is the parameter `lamp_at`. Mitsuba looks
    for the files of an included scene beside the one that includes it.

    Arguments:
        scene: `kept.xml` of an import.
        path: of the fragment, NAME.kept.xml; the name is a part of all ids, so that two lamps'
            fragments may be in one room.

    Returns:
        The fragment.

    Raises:
        PureLightError: the scene cannot be read.
    """
    root, folder = _parsed(scene), path.with_suffix("")
    files = _files(root, scene.parent)
    for element in root.iter():
        if "id" in element.attrib:
            element.set("id", f"{_plain(folder.stem)}_{element.attrib['id']}")
        if element.tag == "string" and element.get("value") in files:
            element.set("value", f"{folder.name}/{element.attrib['value']}")
    for shape in root.findall("shape"):
        place = ET.SubElement(shape, "transform", name="to_world")
        ET.SubElement(place, "matrix", value=f"${PLACE}")
    root.insert(0, ET.Element("default", name=PLACE, value=IDENTITY))
    for name in files:
        _copy(scene.parent / name, folder / name)
    ET.indent(root)
    atomic.write_bytes(path, ET.tostring(root, encoding="utf-8") + b"\n")
    return path


def _parsed(scene: Path) -> ET.Element:
    try:
        return ET.parse(scene).getroot()
    except (OSError, ET.ParseError) as error:
        raise PureLightError(f"{scene}: cannot be read: {error}") from None


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(target, source.read_bytes())


def _files(root: ET.Element, folder: Path) -> set[str]:
    """The files below a folder that a scene names."""
    named = {string.get("value", "") for string in root.iter("string")}
    inside = folder.resolve()
    return {
        name for name in named
        if name and (folder / name).is_file() and (folder / name).resolve().is_relative_to(inside)
    }  # fmt: skip


def _plain(name: str) -> str:
    return re.sub(r"\W", "_", name)
