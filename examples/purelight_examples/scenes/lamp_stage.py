"""A lamp in front of a wall, as it is fixed: what it throws onto plain surfaces."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.catalog import Entry
from purelight_examples.luminaires.lamp_scene import Part, matt, write_parts, write_xml
from purelight_examples.scenes.furniture import wall
from purelight_examples.scenes.interior import CLEAR, View
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_examples.scenes.place import Place, placed
from purelight_examples.scenes.sensor import Picture, sensor

PLASTER, GROUND, CEILING = (0.75, 0.73, 0.69), (0.5, 0.42, 0.34), (0.75, 0.74, 0.71)
WIDE = 14.0  # half the width of everything, in units


@dataclass(frozen=True)
class Setting:
    """Where plain surfaces are about a lamp, in units, whose length is in parts of its radius.

    Arguments:
        unit: in radii of the lamp.
        wall: behind the lamp's frame; 0 touches it.
        floor: below the lamp's lowest point; ceiling: whether it hangs right below one.
        turn: of the lamp, in degrees about Z.
        origin, target: of the camera; fov: in degrees.
    """

    unit: float
    wall: float
    floor: float
    ceiling: bool
    origin: tuple[float, float, float]
    target: tuple[float, float, float]
    turn: float = 0.0
    fov: float = 42.0


SETTINGS = {
    "hung": Setting(1.0, 1.9, 2.2, False, (-3.2, -7.0, 0.5), (0.0, 0.5, -0.6)),
    "ceiling": Setting(1.0, 2.2, 5.0, True, (-3.2, -7.0, -2.2), (0.0, 0.8, -1.0)),
    "recess": Setting(5.0, 0.9, 6.0, True, (-2.4, -5.2, -2.2), (0.0, 0.6, -1.25)),
    "wall": Setting(1.2, 0.0, 5.0, False, (-3.0, -6.5, 0.3), (0.0, 0.0, -0.1), -90.0),
    "table": Setting(1.0, 1.6, 0.0, False, (-3.0, -6.8, 1.2), (0.0, 0.4, 0.0)),
    "pole": Setting(4.0, 0.35, 3.6, False, (-4.0, -7.2, -1.5), (0.0, 0.0, -2.0), -90.0),
}


def write(folder: Path, entry: Entry, lamp: LampChoice, picture: Picture, name: str) -> Path:
    """Write `<name>.xml` and its meshes; returns the XML's path.

    Arguments:
        lamp: what stands for the entry's lamp.
    """
    setting = SETTINGS[entry.mount]
    bounds = np.array([part.mesh.bounds for part in entry.lamp.parts()])
    low, high = bounds[:, 0].min(0), bounds[:, 1].max(0)
    view = _view(setting, low, high)
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    scene.append(sensor(picture, view.origin, view.target, view.fov))
    scene.extend(write_parts(folder, name, parts(entry, low, high)))
    scene.extend(placed(lamp, Place((0.0, 0.0, 0.0), setting.turn), folder, 0))
    return write_xml(folder / f"{name}.xml", scene)


def parts(entry: Entry, low: np.ndarray, high: np.ndarray) -> list[Part]:
    """Wall, floor and ceiling, and the cord of what hangs.

    Arguments:
        low, high: corners of the lamp's box, [3] in metres.
    """
    setting, unit = SETTINGS[entry.mount], _unit(entry.mount, low, high)
    back = max(setting.wall * unit, CLEAR) if setting.wall else CLEAR
    floor, half = low[2] - setting.floor * unit - CLEAR, WIDE * unit
    made = [
        matt("wall", wall((0, back, 0), -2, (half, half)), PLASTER),
        matt("floor", wall((0, 0, floor), 3, (half, half)), GROUND),
    ]
    if entry.mount == "recess":
        hole = 0.97 * float(np.abs([low[:2], high[:2]]).max())
        made.append(
            matt("ceiling", plate_with_hole(half, hole).apply_translation([0, 0, CLEAR]), CEILING)
        )
    elif setting.ceiling:
        made.append(matt("ceiling", wall((0, 0, high[2] + CLEAR), -3, (half, half)), CEILING))
    if entry.mount == "hung":
        rod = trimesh.creation.cylinder(0.015 * unit, half, sections=12)
        rod.apply_translation([0, 0, high[2] + CLEAR + 0.5 * half])
        made.append(matt("cord", rod, (0.05, 0.05, 0.05)))
    return made


def plate_with_hole(half: float, radius: float, steps: int = 96) -> trimesh.Trimesh:
    """A square sheet at z = 0 that faces down, with a round hole in its middle."""
    angle = 2 * np.pi * np.arange(steps) / steps
    ring = np.stack((np.cos(angle), np.sin(angle), np.zeros(steps)), 1)
    square = ring / np.abs(ring).max(1, keepdims=True)
    i, j = np.arange(steps), (np.arange(steps) + 1) % steps
    faces = np.concatenate((np.stack((i, j, j + steps), 1), np.stack((i, j + steps, i + steps), 1)))
    return trimesh.Trimesh(np.concatenate((radius * ring, half * square)), faces, process=False)


def _unit(mount: str, low: np.ndarray, high: np.ndarray) -> float:
    return SETTINGS[mount].unit * 0.5 * float(np.linalg.norm(high - low))


def _view(setting: Setting, low: np.ndarray, high: np.ndarray) -> View:
    """The camera in metres, about the middle of the lamp's height."""
    unit = setting.unit * 0.5 * float(np.linalg.norm(high - low))
    middle = np.array([0, 0, 0.5 * (low[2] + high[2])])
    x, y, z = (unit * np.array(setting.origin) + middle).tolist()
    a, b, c = (unit * np.array(setting.target) + middle).tolist()
    return View((x, y, z), (a, b, c), setting.fov)
