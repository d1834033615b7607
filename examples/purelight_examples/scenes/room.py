"""A small furnished room with a lamp that hangs below its ceiling, as a Mitsuba 3 scene."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import trimesh

from purelight_examples.luminaires.lamp_scene import Material, Part, matt, write_parts, write_xml
from purelight_examples.scenes.furniture import boxes, turned, wall
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_examples.scenes.sensor import Picture, sensor

# The origin is the middle of the room: ray offsets grow with coordinates, and glass is thin
WIDTH, DEPTH, HEIGHT = 3.0, 3.0, 2.6
FLOOR, CEILING = -HEIGHT / 2, HEIGHT / 2
LAMP_AT = (0.1, 0.15, 0.5)
LAMP_CLEARANCE = 0.13
CAMERA = (-1.38, -1.42, 0.22)
TARGET = (0.28, 0.4, -0.22)
FOV = 66.0


def write(
    folder: Path, lamp: LampChoice, picture: Picture | None = None, name: str = "room"
) -> Path:
    """Write `<name>.xml` and the room's meshes; returns the XML's path."""
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    scene.append(sensor(picture or Picture(), CAMERA, TARGET, FOV))
    scene.extend(write_parts(folder, "room", parts()))
    scene.extend(lamp.elements(folder, LAMP_AT))
    return write_xml(folder / f"{name}.xml", scene)


def parts() -> list[Part]:
    """The room's meshes by material."""
    return [*_walls(), *_furniture(), *_on_the_table()]


def _walls() -> list[Part]:
    x, y, z = WIDTH / 2, DEPTH / 2, HEIGHT / 2
    plaster = trimesh.util.concatenate([
        wall((0, 0, CEILING), -3, (x, y)), wall((0, -y, 0), 2, (z, x)), wall((-x, 0, 0), 1, (y, z)),
    ])  # fmt: skip
    return [
        matt("plaster", plaster, (0.76, 0.74, 0.7)),
        matt("floor", wall((0, 0, FLOOR), 3, (x, y)), (0.36, 0.24, 0.15)),
        matt("right_wall", wall((x, 0, 0), -1, (y, z)), (0.16, 0.36, 0.4)),
        matt("back_wall", wall((0, y, 0), -2, (z, x)), (0.68, 0.6, 0.5)),
    ]


def _furniture() -> list[Part]:
    cord_foot = LAMP_AT[2] + LAMP_CLEARANCE
    cord = trimesh.creation.cylinder(0.004, CEILING - 0.005 - cord_foot, sections=16)
    cord.apply_translation((LAMP_AT[0], LAMP_AT[1], (CEILING - 0.005 + cord_foot) / 2))
    shelf = [((1.33, 0.4, z), (0.3, 1.5, 0.03)) for z in (-0.35, 0.05, 0.45)]
    shelf += [((1.33, y, 0.0), (0.3, 0.03, 1.05)) for y in (-0.35, 1.15)]
    sofa = [((-0.35, 1.1, -1.0), (1.3, 0.6, 0.35)), ((-0.35, 1.4, -0.75), (1.3, 0.16, 0.5))]
    sofa += [((x, 1.1, -0.85), (0.14, 0.62, 0.5)) for x in (-1.06, 0.36)]
    frame = boxes([((-0.3, 1.485, 0.3), (0.8, 0.02, 0.55))])
    canvas = boxes([((-0.3, 1.475, 0.3), (0.7, 0.02, 0.45))])
    return [
        matt("cord", cord, (0.05, 0.05, 0.05)),
        matt("shelf", boxes(shelf), (0.5, 0.33, 0.18)),
        matt("sofa", boxes(sofa), (0.5, 0.16, 0.1)),
        matt("rug", boxes([((0.1, 0.1, FLOOR + 0.008), (1.7, 1.5, 0.012))]), (0.55, 0.5, 0.42)),
        matt("frame", frame, (0.06, 0.05, 0.04)),
        matt("canvas", canvas, (0.75, 0.55, 0.2)),
        *_books(),
    ]


def _books() -> list[Part]:
    colors = [(0.55, 0.12, 0.1), (0.12, 0.25, 0.5), (0.7, 0.6, 0.4), (0.15, 0.35, 0.2)]
    rows: list[list] = [[] for _ in colors]
    for shelf in (-0.335, 0.065):
        y = -0.3
        for i in range(19):
            thick, tall = 0.03 + 0.007 * (i * 7 % 4), 0.22 + 0.02 * (i * 5 % 5)
            rows[i * 3 % 4].append(((1.34, y + thick / 2, shelf + tall / 2), (0.18, thick, tall)))
            y += thick + 0.004
    named = zip(rows, colors, strict=True)
    return [matt(f"books_{i}", boxes(row), color) for i, (row, color) in enumerate(named)]


def _on_the_table() -> list[Part]:
    x, y, top = 0.25, 0.1, -0.75
    table = [(0, -0.54), (0.24, -0.54), (0.24, -0.52), (0.04, -0.5), (0.03, -0.06), (0.42, -0.05)]
    table += [(0.42, -0.002), (0, 0)]
    vase = [(0, 0), (0.05, 0), (0.07, 0.04), (0.1, 0.14), (0.03, 0.24), (0.05, 0.3), (0.035, 0.3)]
    vase += [(0.02, 0.24), (0, 0.23)]
    copper = Material(
        "roughconductor",
        {"material": "none", "distribution": "ggx", "alpha": 0.15},
        {"specular_reflectance": (0.93, 0.62, 0.5)},
    )
    glazed = Material("roughplastic", {"alpha": 0.08}, {"diffuse_reflectance": (0.1, 0.35, 0.22)})
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.09)
    return [
        matt("table", turned(table, (x, y, top)), (0.42, 0.27, 0.15)),
        Part("vase", turned(vase, (x + 0.12, y + 0.1, top + 0.002)), glazed),
        Part("ball", ball.apply_translation((x - 0.16, y - 0.05, top + 0.093)), copper),
        matt("tray", boxes([((x + 0.02, y - 0.22, top + 0.012), (0.26, 0.18, 0.02))]), (0.7,) * 3),
    ]
