"""Mitsuba plugins as XML elements, from Python values."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

RGB = tuple[float, float, float]
Value = float | bool | str | RGB | ET.Element


def plugin(tag: str, kind: str, **values: Value) -> ET.Element:
    """A plugin of a kind with its properties: numbers, words, colours, or plugins."""
    element = ET.Element(tag, type=kind)
    for name, value in values.items():
        element.append(_property(name, value))
    return element


def bsdf(kind: str, **values: Value) -> ET.Element:
    """A material."""
    return plugin("bsdf", kind, **values)


def point(name: str, at: Sequence[float]) -> ET.Element:
    """A point in metres."""
    x, y, z = (f"{v:.9g}" for v in at)
    return ET.Element("point", name=name, x=x, y=y, z=z)


def transform(matrix: NDArray[np.float64]) -> ET.Element:
    """A `to_world` of a 4x4 matrix; what is but rounding becomes zero."""
    element = ET.Element("transform", name="to_world")
    least = 1e-12 * np.abs(matrix[:3]).max()
    values = np.where(np.abs(matrix) < least, 0.0, matrix)
    ET.SubElement(element, "matrix", value=" ".join(f"{v:.9g}" for v in values.ravel()))
    return element


def _property(name: str, value: Value) -> ET.Element:
    if isinstance(value, ET.Element):
        child = copy.deepcopy(value)
        child.set("name", name)
        return child
    if isinstance(value, tuple):
        return ET.Element("rgb", name=name, value=", ".join(f"{v:.6g}" for v in value))
    if isinstance(value, bool):
        return ET.Element("boolean", name=name, value=str(value).lower())
    if isinstance(value, str):
        return ET.Element("string", name=name, value=value)
    return ET.Element("float", name=name, value=f"{float(value):.9g}")


def scale_bumps(element: ET.Element, factor: float) -> None:
    """Make bump maps in an element higher: their height is a length, as the lamp's size is."""
    for bsdf in element.iter("bsdf"):
        if bsdf.get("type") == "bumpmap":
            height = bsdf.find("float[@name='scale']")
            height = ET.SubElement(bsdf, "float", name="scale") if height is None else height
            height.set("value", f"{float(height.get('value', 1)) * factor:.9g}")
