"""Scenes of Mitsuba 0.5 and 0.6, brought to the words of Mitsuba 3.

Mitsuba's own upgrade renames parameters. What it does not know is done here first: colours, black
bodies, cameras' up, and plugins that are no more.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

from purelight_import.model.color import KELVIN, black_body
from purelight_import.model.notes import Notes
from purelight_import.model.picture import decode

SEPARATORS = re.compile(r"[,\s]+")
GONE = {"phong": "roughplastic", "ward": "roughplastic", "difftrans": "principledthin"}
UNKNOWN = {"hk", "irawan", "hanrahankrueger", "sssbrdf"}
NAMED = ("shape", "bsdf")
WRAPPERS = {"coating", "roughcoating"}


def upgrade(root: ET.Element, mi: Any, notes: Notes) -> ET.Element:
    """A scene of an older version in the words of Mitsuba 3.

    Raises:
        RuntimeError: Mitsuba does not understand it.
    """
    for parent in list(root.iter()):
        for index, element in enumerate(list(parent)):
            _value(parent, element, notes)
            if element.tag == "bsdf":
                parent[index] = _bsdf(element, notes)
            elif element.tag == "subsurface":
                notes("subsurface scattering is left out")
                parent.remove(element)
    names = {tag: [e.get("id", "") for e in root.iter(tag)] for tag in NAMED}
    folders = [s.attrib.pop("folder", None) for s in root.iter("string")]
    paths = [s.get("value") for s in root.iter("string")]
    config = mi.parser.ParserConfig(mi.variant())
    state = mi.parser.parse_string(config, ET.tostring(root, encoding="unicode"))
    mi.parser.transform_upgrade(config, state)
    result = ET.fromstring(mi.parser.write_string(state))
    return _named(result, names, dict(zip(paths, folders, strict=True)))


def _named(
    root: ET.Element, names: dict[str, list[str]], folders: dict[str | None, str | None]
) -> ET.Element:
    """With names, which the upgrade forgets where nothing refers to them, and shorter numbers."""
    for tag, wanted in names.items():
        for element, name in zip(root.iter(tag), wanted, strict=True):
            if name:
                element.set("id", name)
    for element in root.iter():
        if element.tag in ("float", "rgb"):
            numbers = [float(x) for x in SEPARATORS.split(element.get("value", "").strip())]
            element.set("value", ", ".join(f"{x:.9g}" for x in numbers))
    for string in root.iter("string"):
        folder = folders.get(string.get("value"))
        if folder and string.get("name") == "filename":
            string.set("folder", folder)
    return root


def up_axis(scene: ET.Element) -> str | None:
    """The axis that the scene's camera has up, if it says so and it is one."""
    for element in scene.iter():
        if element.tag.lower() in ("lookat", "look_at") and element.get("up"):
            up = np.array([float(x) for x in SEPARATORS.split(element.attrib["up"].strip())])
            axis = int(np.abs(up).argmax())
            if np.abs(up[axis]) > 0.9 * np.linalg.norm(up):
                return ("-" if up[axis] < 0 else "") + "xyz"[axis]
    return None


def _value(parent: ET.Element, element: ET.Element, notes: Notes) -> None:
    """Brings one value to a form that Mitsuba 3 has."""
    if element.tag in ("lookAt", "look_at"):
        element.tag = "lookat"
    elif element.tag == "srgb":
        _set(element, _srgb(element.get("value", "")))
    elif element.tag in ("rgb", "spectrum") and element.get("value"):
        text = element.attrib["value"].strip()
        if text.startswith("#"):
            _set(element, _srgb(text))
        elif ":" not in text:
            _set(element, [float(x) for x in SEPARATORS.split(text)])
    elif element.tag == "blackbody":
        _black_body(element, notes)
    elif element.tag == "luminaire":
        element.tag = "emitter"
    if parent.tag == "emitter" and element.get("name") == "samplingWeight":
        parent.remove(element)


def _set(element: ET.Element, values: list[float]) -> None:
    element.tag = "rgb"
    values = values * 3 if len(values) == 1 else values
    element.set("value", ", ".join(f"{v:.9g}" for v in values))


def _srgb(text: str) -> list[float]:
    if text.startswith("#") and len(text) == 7:
        encoded = [int(text[k : k + 2], 16) / 255 for k in (1, 3, 5)]
    else:
        encoded = [float(x) for x in SEPARATORS.split(text.strip())]
    return decode(np.array(encoded)).tolist()


def _black_body(element: ET.Element, notes: Notes) -> None:
    kelvin = float(element.get("temperature", "6500").rstrip("kK "))
    scale = float(element.get("scale", element.get("multiplier", "1")))
    notes("black bodies are taken by their colour, not their strength; state lumens")
    color = black_body(float(np.clip(kelvin, *KELVIN)))
    for key in ("temperature", "scale", "multiplier"):
        element.attrib.pop(key, None)
    _set(element, [scale * c for c in color])


def _bsdf(bsdf: ET.Element, notes: Notes) -> ET.Element:
    """A BSDF of today for one that is no more."""
    kind = bsdf.get("type", "")
    name = bsdf.get("id", "")
    if kind in WRAPPERS:
        notes("clear coats are left out", name)
        inner = bsdf.find("bsdf")
        inner = ET.Element("bsdf", type="diffuse") if inner is None else inner
        for key in ("id", "name"):
            if bsdf.get(key):
                inner.set(key, bsdf.attrib[key])
        return inner
    if kind == "mixturebsdf":
        return _mixture(bsdf, notes)
    if kind in GONE:
        notes(f"{kind} is taken as {GONE[kind]}", name)
        return _replaced(bsdf, kind)
    if kind in UNKNOWN:
        notes(f"{kind} is taken as a matt surface", name)
        return ET.Element("bsdf", {**_keys(bsdf), "type": "diffuse"})
    return bsdf


def _replaced(bsdf: ET.Element, kind: str) -> ET.Element:
    result = ET.Element("bsdf", {**_keys(bsdf), "type": GONE[kind]})
    values = {e.get("name"): e for e in bsdf}
    if kind == "difftrans":
        color = values.get("transmittance")
        if color is not None:
            color.set("name", "base_color")
            result.append(color)
        ET.SubElement(result, "float", name="diff_trans", value="2")
        return result
    if "diffuseReflectance" in values:
        result.append(values["diffuseReflectance"])
    exponent = values.get("exponent")
    alpha = 0.1
    if exponent is not None and exponent.get("value"):
        alpha = float(np.sqrt(2 / (float(exponent.attrib["value"]) + 2)))
    elif "alphaU" in values:
        alpha = float(values["alphaU"].get("value", "0.1"))
    ET.SubElement(result, "float", name="alpha", value=f"{alpha:.4g}")
    return result


def _mixture(bsdf: ET.Element, notes: Notes) -> ET.Element:
    """A mixture of two as Mitsuba's blend; of others only the heaviest."""
    inner = bsdf.findall("bsdf") + bsdf.findall("ref")
    text = next((e.get("value", "") for e in bsdf if e.get("name") == "weights"), "")
    weights = [float(x) for x in SEPARATORS.split(text.strip()) if x]
    if len(inner) == 2 and len(weights) == 2:
        result = ET.Element("bsdf", {**_keys(bsdf), "type": "blendbsdf"})
        total = sum(weights) or 1.0
        ET.SubElement(result, "float", name="weight", value=f"{weights[1] / total:.6g}")
        result.extend(inner)
        return result
    notes("of a mixture of materials the heaviest is taken", bsdf.get("id", ""))
    best = bsdf.find("bsdf")
    if best is None:
        return ET.Element("bsdf", {**_keys(bsdf), "type": "diffuse"})
    best.attrib.update(_keys(bsdf))
    return best


def _keys(bsdf: ET.Element) -> dict[str, str]:
    return {key: bsdf.attrib[key] for key in ("id", "name") if bsdf.get(key)}
