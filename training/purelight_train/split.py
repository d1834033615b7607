"""A lamp's scene in two: what is learned, and the parts that are kept as ordinary geometry."""

from __future__ import annotations

import copy
import hashlib
import json
import os
import shutil
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path

from purelight_format.errors import PureLightError

KEPT = "kept.xml"
RECORD = "split.json"
PLACE = "lamp_at"  # Parameter of kept.xml: the lamp's to_world, as 16 numbers.
IDENTITY = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
OF_A_ROOM = ("emitter", "sensor", "integrator")  # Not of geometry.


def split(scene: Path, names: Sequence[str], folder: Path) -> Path:
    """Writes a lamp without some parts, and `kept.xml` with these, into a folder.

    The files that the scene names are copied there. The parts of `kept.xml` stand where a lamp does
    whose `to_world` is the parameter `lamp_at`.

    Arguments:
        names: ids of shapes.
        folder: that nobody else uses; a split that was made there alike is taken as it is.

    Returns:
        The lamp's scene.

    Raises:
        PureLightError: a part is not there, or shines, or none is left; nothing is written.
    """
    tree = _parse(scene)
    record = {"scene": hashlib.sha256(scene.read_bytes()).hexdigest(), "keep": sorted(names)}
    lamp = folder / scene.name
    if folder.exists():
        if _record(folder) != record:
            raise PureLightError(f"{folder}: holds something else; choose another --output")
        return lamp
    chosen = _chosen(scene, tree, names)
    folder.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    try:
        _copy_files(tree, scene.parent, draft)
        _write(_kept(tree, chosen), draft / KEPT)
        for shape in chosen:
            tree.remove(shape)
        _write(tree, draft / scene.name)
        (draft / RECORD).write_text(json.dumps(record))
        os.replace(draft, folder)
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return lamp


def part_names(scene: Path) -> list[str]:
    """Ids of the shapes of a scene that have one."""
    return [shape.attrib["id"] for shape in _parse(scene).findall("shape") if "id" in shape.attrib]


def _parse(scene: Path) -> ET.Element:
    try:
        root = ET.parse(scene).getroot()
    except (OSError, ET.ParseError) as error:
        raise PureLightError(f"{scene}: cannot be read: {error}") from None
    if root.tag != "scene":
        raise PureLightError(f"{scene}: the file holds no <scene>; wrap the lamp's shapes in one")
    return root


def _record(folder: Path) -> object:
    try:
        return json.loads((folder / RECORD).read_text())
    except (OSError, ValueError):
        return None


def _chosen(scene: Path, tree: ET.Element, names: Iterable[str]) -> list[ET.Element]:
    """The shapes of these names."""
    by_name = {shape.get("id"): shape for shape in tree.findall("shape")}
    for name in names:
        shape = by_name.get(name)
        if shape is None:
            known = ", ".join(sorted(filter(None, by_name))) or "none has an id"
            raise PureLightError(f"{scene}: no part is called {name}; there are: {known}")
        if shape.find("emitter") is not None:
            raise PureLightError(f"{scene}: part {name} shines; only dark parts can be kept")
        if shape.get("type") in ("shapegroup", "instance"):
            raise PureLightError(f"{scene}: part {name} is an instance; make it a shape of its own")
    wanted = set(names)
    chosen = [shape for shape in tree.findall("shape") if shape.get("id") in wanted]
    if len(chosen) == len(tree.findall("shape")):
        raise PureLightError(f"{scene}: nothing of the lamp is left; keep fewer parts")
    return chosen


def _kept(tree: ET.Element, chosen: Sequence[ET.Element]) -> ET.Element:
    """A scene of the kept parts and all materials, which another scene may include."""
    kept = ET.Element("scene", tree.attrib)
    kept.append(ET.Element("default", name=PLACE, value=IDENTITY))
    for element in tree:
        if element.tag not in (*OF_A_ROOM, "shape"):
            kept.append(copy.deepcopy(element))
    for element in chosen:
        shape = copy.deepcopy(element)
        place = shape.find("transform[@name='to_world']")
        if place is None:
            place = ET.SubElement(shape, "transform", name="to_world")
        ET.SubElement(place, "matrix", value=f"${PLACE}")
        kept.append(shape)
    return kept


def _copy_files(tree: ET.Element, source: Path, folder: Path) -> None:
    """Copies the files that a scene names, and names the copies instead."""
    names: dict[str, str] = {}
    for element in tree.iter("string"):
        value = element.get("value", "")
        if element.get("name") != "filename" or not (source / value).is_file():
            continue
        if value not in names:
            own = f"{len(names)}_{Path(value).name}"
            shutil.copyfile(source / value, folder / own)
            names[value] = own
        element.set("value", names[value])


def _write(tree: ET.Element, path: Path) -> None:
    ET.indent(tree)
    path.write_bytes(ET.tostring(tree, encoding="utf-8") + b"\n")
