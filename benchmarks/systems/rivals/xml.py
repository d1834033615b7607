"""Pieces of Mitsuba scenes that the rivals write."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

from purelight_examples.scenes.lamp_choice import Point, RealLamp, move, relative


def file_emitter(kind: str, file: Path, folder: Path, at: Point) -> ET.Element:
    """An emitter made of a file, for a scene in `folder`, its frame's origin at `at`."""
    light = ET.Element("emitter", type=kind, id="lamp")
    ET.SubElement(light, "string", name="filename", value=relative(file, folder))
    move(light, at)
    return light


def stock(plugin: str) -> ET.Element:
    """One of Mitsuba's integrators as the real lamps are rendered by."""
    return RealLamp(Path(), plugin).integrator()
