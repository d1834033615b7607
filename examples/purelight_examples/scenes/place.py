"""Where a lamp hangs or stands in a room."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from purelight_examples.scenes.lamp_choice import LampChoice, Point


@dataclass(frozen=True)
class Place:
    """Of a lamp's frame in a room.

    Arguments:
        at: its origin in metres.
        turn: degrees about Z.
        scale: its size over its own.
    """

    at: Point
    turn: float = 0.0
    scale: float = 1.0


def placed(lamp: LampChoice, place: Place, folder: Path, number: int) -> list[ET.Element]:
    """The lamp's elements at a place, for a scene file in `folder`.

    Arguments:
        number: of this lamp in its room, which makes names unique.
    """
    elements = lamp.elements(folder, (0.0, 0.0, 0.0))
    for element in elements:
        element.set("id", f"{element.get('id', 'lamp')}_{number}")
        transform = element.find("transform[@name='to_world']")
        if transform is None:
            transform = ET.SubElement(element, "transform", name="to_world")
        if place.turn:
            ET.SubElement(transform, "rotate", z="1", angle=f"{place.turn:g}")
        if place.scale != 1:
            ET.SubElement(transform, "scale", value=f"{place.scale:g}")
        ET.SubElement(transform, "translate", value=", ".join(f"{v:.6g}" for v in place.at))
    return elements
