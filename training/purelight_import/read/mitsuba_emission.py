"""What area emitters of a Mitsuba scene emit."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_import.model.color import KELVIN, black_body
from purelight_import.model.material import RGB, WHITE, Color
from purelight_import.model.notes import Notes
from purelight_import.model.picture import Picture
from purelight_import.read import images
from purelight_import.read.mitsuba05 import SEPARATORS
from purelight_import.read.mitsuba_load import load

EVEN = ("d65", "rawconstant", "srgb", "uniform")  # textures that are one colour


def radiance(mi: Any, emitter: ET.Element, name: str, notes: Notes) -> Color | None:
    """Radiance of an area emitter; None if it is dark.

    Arguments:
        name: of its shape.

    Raises:
        PureLightError: it is given in a way that is not taken.
    """
    if emitter.get("type") != "area":
        notes(f"{emitter.get('type', '')[:40]} emitters are taken as even ones (area)", name)
    value = next((e for e in emitter if e.get("name") == "radiance"), None)
    if value is None:
        return WHITE
    if value.get("type") == "bitmap":
        return _texture(mi, value)
    color = _color(mi, value, name, notes)
    return color if max(color) > 0 else None


def _color(mi: Any, value: ET.Element, name: str, notes: Notes) -> RGB:
    """A colour; what is neither one nor a black body as Mitsuba makes one of it."""
    if value.get("type") == "blackbody":
        kelvin = next((float(e.get("value", 0)) for e in value if e.get("name") == "temperature"),
                      6500.0)  # fmt: skip
        notes("black bodies are taken by their colour, not their strength; state lumens")
        return black_body(float(np.clip(kelvin, *KELVIN)))
    if value.tag in ("rgb", "float"):
        numbers = [float(x) for x in SEPARATORS.split(value.get("value", "").strip())]
    else:
        numbers = _evaluated(mi, value, name)
    r, g, b = numbers * 3 if len(numbers) == 1 else numbers[:3]
    return max(r, 0.0), max(g, 0.0), max(b, 0.0)


def _evaluated(mi: Any, value: ET.Element, name: str) -> list[float]:
    """Numbers of a spectrum or an even texture, in the digits that float32 has."""
    shape = ET.Element("shape", type="sphere")
    ET.SubElement(shape, "emitter", type="area").append(value)
    kind, taken = value.get("type", value.tag)[:40], value.tag != "texture"
    parameters = mi.traverse(load(mi, shape).emitter()) if taken or kind in EVEN else {}
    if "radiance.value" not in parameters:
        raise PureLightError(f"emission of '{name}' as {kind} is not taken; give it as <rgb>")
    numbers = np.array(parameters["radiance.value"], np.float64).ravel()
    return [float(f"{x:.7g}") for x in numbers]


def _texture(mi: Any, texture: ET.Element) -> Picture:
    """A bitmap as emission."""
    values = {e.get("name"): e.get("value", "") for e in texture}
    if "filename" not in values:
        raise PureLightError("emission by a bitmap without a file is not taken")
    path = Path(values["filename"])
    wrap = {"clamp": "clamp", "mirror": "mirror"}.get(values.get("wrap_mode", ""), "repeat")
    raw = values.get("raw", "").strip().lower() == "true"
    picture = images.load(path, srgb=not raw).colors()
    return replace(picture, wrap=wrap, to_uv=_to_uv(mi, texture),
                   smooth=values.get("filter_type") != "nearest")  # fmt: skip


def _to_uv(mi: Any, texture: ET.Element) -> NDArray[np.float64] | None:
    """The transform of a texture's coordinates, which Mitsuba reads on a texture without a file."""
    transform = texture.find("transform[@name='to_uv']")
    if transform is None:
        return None
    shape = ET.Element("shape", type="rectangle")
    bsdf = ET.SubElement(shape, "bsdf", type="diffuse")
    ET.SubElement(bsdf, "texture", type="checkerboard", name="reflectance").append(transform)
    found = mi.traverse(load(mi, shape).bsdf())["reflectance.to_uv"]
    return np.array(found.matrix, np.float64).reshape(3, 3)
