"""References and instances of Mitsuba's XML, which become copies of what they stand for."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator

from purelight_format.errors import PureLightError
from purelight_import.model import limits


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
