"""Mitsuba's XML of any version: files included, parameters filled in, what is no lamp left out."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn

from purelight_format import files
from purelight_import.model import limits
from purelight_import.read.beside import beside

ROOM = {"integrator", "sensor", "camera", "sampler", "film", "rfilter", "test", "path", "alias"}
# Elements that may name a file, and the attribute that holds the name
FILES = {"string": "value", "spectrum": "filename"}
INCLUDES = 15  # files within each other
ELEMENTS = 500_000


class Plain(ET.TreeBuilder):
    """Refuses document types, and with them entities."""

    def doctype(self, *_: object) -> NoReturn:
        raise ValueError("it has a document type, which no scene needs")


def read_scene(path: Path) -> ET.Element:
    """The scene of a file, self-contained but for meshes and pictures, whose paths are absolute.

    Raises:
        PureLightError: a file that it names cannot be read.
        ValueError: it is broken.
    """
    root = parse(path)
    if root.tag != "scene":
        raise ValueError(f"it begins with <{root.tag[:40]}>, so it is no Mitsuba scene")
    folder = path.resolve().parent
    reading = _Reading(folder)
    reading.take_in(root, folder)
    if sum(1 for _ in root.iter()) > ELEMENTS:
        raise ValueError("it has too many elements")
    _fill_in(root)
    for reference in root.iter("ref"):
        name = reference.get("id", "")
        reference.set("id", reading.aliases.get(name, name))
    return root


def version(root: ET.Element) -> tuple[int, int]:
    """Major and minor version of Mitsuba for which a scene was written."""
    found = re.match(r"(\d+)(?:\.(\d+))?", root.get("version", ""))
    if not found:
        raise ValueError("its <scene> states no version")
    return int(found[1]), int(found[2] or 0)


def parse(path: Path) -> ET.Element:
    """The content of one file.

    Raises:
        ValueError: it is no XML, or has a document type.
    """
    data = files.read_file(path, limits.TEXT_BYTES)
    try:
        return ET.fromstring(data, ET.XMLParser(target=Plain()))
    except ET.ParseError as error:
        raise ValueError(f"it is no XML: {error}") from None


@dataclass
class _Reading:
    """A scene whose files are put together.

    Arguments:
        folder: of the scene.
        paths: folders in which files lie too, those named last first.
        values: parameters so far.
        aliases: what other names of identifiers stand for.
    """

    folder: Path
    paths: list[Path] = field(default_factory=list)
    values: dict[str, str] = field(default_factory=dict)
    aliases: dict[str, str] = field(default_factory=dict)

    def take_in(self, parent: ET.Element, own: Path, depth: int = 0) -> None:
        """Puts the content of included files in their place, and notes where others may lie.

        Arguments:
            own: folder of the file that `parent` was read from.

        Raises:
            PureLightError: a file that it names cannot be read.
            ValueError: it is broken.
        """
        if depth > INCLUDES:
            raise ValueError("files include each other without an end")
        children: list[ET.Element] = []
        for child in list(parent):
            children += self._taken(child, own, depth)
        parent[:] = children

    def _taken(self, child: ET.Element, own: Path, depth: int) -> list[ET.Element]:
        """What stands in the place of an element."""
        if child.tag == "include":
            return self._included(filled(child.get("filename", ""), self.values), own, depth)
        if child.tag == "default":
            self.values.setdefault(child.get("name", ""), child.get("value", ""))
        elif child.tag == "path":
            self._search(filled(child.get("value", ""), self.values), own)
        elif child.tag == "alias":
            name = child.get("id", "")
            self.aliases[child.get("as", "")] = self.aliases.get(name, name)
        if child.tag in ROOM:
            return []
        self._mark(child, own)
        self.take_in(child, own, depth)
        return [child]

    def _included(self, name: str, own: Path, depth: int) -> list[ET.Element]:
        path = beside(self._holder(name, own), name)
        inner = parse(path)
        self.take_in(inner, path.parent, depth + 1)
        return list(inner) if inner.tag == "scene" else [inner]

    def _search(self, name: str, own: Path) -> None:
        """Adds a folder; one that lies outside the lamp's is left out, as its files would be."""
        folder = (own / name.replace("\\", "/")).resolve()
        if folder.is_dir() and folder.is_relative_to(self.folder):
            self.paths.insert(0, folder)

    def _mark(self, element: ET.Element, own: Path) -> None:
        """Notes in which folder the file that an element names lies, whatever it says itself."""
        element.attrib.pop("folder", None)
        key = FILES.get(element.tag)
        if key is not None and (key == "filename" or element.get("name") == "filename"):
            name = filled(element.get(key, ""), self.values)
            if name:
                element.set("folder", str(self._holder(name, own)))

    def _holder(self, name: str, own: Path) -> Path:
        """The folder in which a file lies; that of the scene if it is nowhere."""
        there = (f for f in (*self.paths, own) if files.is_file(f / name.replace("\\", "/")))
        return next(there, self.folder)


def _fill_in(root: ET.Element) -> None:
    """Fills in parameters ($name) by their defaults."""
    values: dict[str, str] = {}
    for parent in list(root.iter()):
        for element in [e for e in parent if e.tag == "default"]:
            values.setdefault(element.get("name", ""), element.get("value", ""))
            parent.remove(element)
    for element in root.iter():
        for key, text in element.attrib.items():
            if key != "folder":  # Whose own name may have the sign.
                element.set(key, filled(text, values))


def filled(text: str, values: dict[str, str]) -> str:
    """A text with values in the place of its parameters.

    Raises:
        ValueError: it would be too long.
    """
    for name in sorted(values, key=len, reverse=True) if "$" in text else ():
        text = text.replace(f"${name}", values[name]) if name else text
    if len(text) > limits.TEXT_BYTES // 64:
        raise ValueError("its parameters grow without an end")
    return text


def find_files(element: ET.Element, tags: Iterable[str] = FILES) -> None:
    """Makes the paths of all files that an element names absolute.

    Raises:
        PureLightError: one is missing, or lies outside the lamp's folder.
    """
    for tag in tags:
        for child in element.iter(tag):
            folder = child.attrib.pop("folder", None)
            if folder is not None:
                child.set(FILES[tag], str(beside(Path(folder), child.get(FILES[tag], ""))))


def named_files(element: ET.Element) -> list[str]:
    """The paths of all files that an element names."""
    found = [e.get("value", "") for e in element.iter("string") if e.get("name") == "filename"]
    return found + [e.attrib["filename"] for e in element.iter("spectrum") if e.get("filename")]
