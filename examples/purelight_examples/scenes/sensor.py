"""The camera of a scene."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

from purelight_examples.scenes.lamp_choice import Point


@dataclass(frozen=True)
class Picture:
    """Size of the picture in pixels, and paths per pixel."""

    width: int = 384
    height: int = 288
    spp: int = 64


def sensor(picture: Picture, origin: Point, target: Point, fov: float) -> ET.Element:
    """A pinhole camera with +Z up, in metres and degrees; pixels share no light (box filter)."""
    element = ET.Element("sensor", type="perspective")
    ET.SubElement(element, "float", name="fov", value=f"{fov:g}")
    transform = ET.SubElement(element, "transform", name="to_world")
    at = {"origin": _text(origin), "target": _text(target), "up": "0, 0, 1"}
    ET.SubElement(transform, "lookat", at)
    film = ET.SubElement(element, "film", type="hdrfilm")
    ET.SubElement(film, "integer", name="width", value=str(picture.width))
    ET.SubElement(film, "integer", name="height", value=str(picture.height))
    ET.SubElement(film, "rfilter", type="box")
    sampler = ET.SubElement(element, "sampler", type="independent")
    ET.SubElement(sampler, "integer", name="sample_count", value=str(picture.spp))
    return element


def _text(point: Point) -> str:
    return ", ".join(f"{v:g}" for v in point)
