"""Mitsuba's XML of any version: files included, parameters filled in, what is no lamp left out."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import NoReturn

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.read.beside import beside

ROOM = {"integrator", "sensor", "camera", "sampler", "film", "rfilter", "test", "path", "alias"}
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
    _include(root, folder, folder, 0)
    if sum(1 for _ in root.iter()) > ELEMENTS:
        raise ValueError("it has too many elements")
    _fill_in(root)
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


def _include(root: ET.Element, folder: Path, own: Path, depth: int) -> None:
    """Puts the content of included files in their place, and notes where others may lie.

    Arguments:
        folder, own: of the scene, and of the file that `root` was read from.
    """
    if depth > INCLUDES:
        raise ValueError("files include each other without an end")
    for parent in list(root.iter()):
        for index, element in reversed(list(enumerate(parent))):
            if element.tag in ROOM:
                parent.remove(element)
            elif element.tag == "include":
                path = beside(folder, element.get("filename", ""))
                inner = parse(path)
                _include(inner, folder, path.parent, depth + 1)
                parent.remove(element)
                for child in reversed(list(inner) if inner.tag == "scene" else [inner]):
                    parent.insert(index, child)
            elif element.tag == "string" and element.get("name") == "filename":
                there = files.is_file(own / element.get("value", ""))
                element.attrib.setdefault("folder", str(own if there else folder))


def _fill_in(root: ET.Element) -> None:
    """Fills in parameters ($name) by their defaults."""
    values: dict[str, str] = {}
    for parent in list(root.iter()):
        for element in [e for e in parent if e.tag == "default"]:
            values.setdefault(element.get("name", ""), element.get("value", ""))
            parent.remove(element)
    names = sorted(values, key=len, reverse=True)
    for element in root.iter():
        for key, text in element.attrib.items():
            if "$" in text:
                for name in names:
                    text = text.replace(f"${name}", values[name]) if name else text
                if len(text) > limits.TEXT_BYTES // 64:
                    raise ValueError("its parameters grow without an end")
                element.set(key, text)


def find_files(element: ET.Element) -> None:
    """Makes the paths of all files that an element names absolute.

    Raises:
        PureLightError: one is missing, or lies outside the lamp's folder.
    """
    for string in element.iter("string"):
        folder = string.attrib.pop("folder", None)
        if folder is not None:
            string.set("value", str(beside(Path(folder), string.get("value", ""))))


def by_id(root: ET.Element) -> dict[str, ET.Element]:
    """All elements that have an identifier, but for references to them."""
    return {e.attrib["id"]: e for e in root.iter() if e.get("id") and e.tag != "ref"}


def resolved(element: ET.Element, known: dict[str, ET.Element], depth: int = 0) -> ET.Element:
    """A copy of an element with what its references stand for.

    Raises:
        ValueError: a reference has no target, or they go in circles.
    """
    if depth > 32:
        raise ValueError("its references go in circles")
    result = ET.Element(element.tag, element.attrib)
    for child in element:
        if child.tag != "ref":
            result.append(resolved(child, known, depth + 1))
            continue
        target = known.get(child.get("id", ""))
        if target is None:
            raise ValueError(f"it refers to '{child.get('id', '')}', which is not there")
        copy = resolved(target, known, depth + 1)
        name = child.get("name")
        copy.attrib.pop("name", None)
        if name and not name.startswith("_arg"):
            copy.set("name", name)
        result.append(copy)
    return result


def shapes(root: ET.Element, known: dict[str, ET.Element]) -> Iterator[ET.Element]:
    """The shapes of a scene without references, instances as copies of what they show.

    Raises:
        PureLightError: there are too many.
    """
    count = 0
    for element in root.findall("shape"):
        for shape in _expanded(element, known):
            count += 1
            if count > limits.NODES // 10:
                raise PureLightError("more than 10,000 shapes; join those of one material")
            yield shape


def _expanded(element: ET.Element, known: dict[str, ET.Element]) -> Iterator[ET.Element]:
    kind = element.get("type")
    if kind == "shapegroup":
        return
    shape = resolved(element, known)
    if kind not in ("instance", "merge"):
        yield shape
        return
    groups = shape.findall("shape")
    move = shape.find("transform") if kind == "instance" else None
    for group in groups:
        inner = group.findall("shape") if kind == "instance" else [group]
        for child in inner:
            if move is not None:
                _then(child, move)
            yield child


def _then(shape: ET.Element, move: ET.Element) -> None:
    """Applies a transform after the shape's own."""
    own = shape.find("transform[@name='to_world']")
    if own is None:
        own = ET.SubElement(shape, "transform", name="to_world")
    own.extend(list(move))
