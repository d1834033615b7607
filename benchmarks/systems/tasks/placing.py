"""A lamp at the origin of a task's scene, enlarged where its size is free.

Mitsuba lifts rays off surfaces by 9e-5 (1 + |coordinate|), whatever the lamp's size: one of
centimetres loses per cents of its light. Radiance does not change with size, so the real lamp is
rendered metres across, as is the bundle. Other lamps stay as large as they are, unless they say
that they may be `enlarged`; what they lose of it is the lift of a matt floor.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

from benchmarks.systems.protocol import Subject
from purelight_examples.luminaires.lamp_scene import Part, write_parts, write_xml
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp, RealLamp, move
from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere

RADIUS = 20.0  # of an enlarged lamp, in m
CLEAR = 1.75  # radii that what is judged passes the lamp by: beyond a box about its sphere
ROULETTE = 16  # bounces before it in the open, least noisy at equal time by `benchmarks.roulette`


def factor(subject: Subject, lamp: LampChoice) -> float:
    """How many times as large as itself a lamp stands in its scene."""
    free = getattr(lamp, "enlarged", isinstance(lamp, RealLamp | NeuralLamp))
    return RADIUS / subject.radius if free else 1.0


def sphere(subject: Subject, lamp: LampChoice) -> BoundingSphere:
    """The lamp's bounding sphere in its scene, about the origin."""
    return BoundingSphere((0.0, 0.0, 0.0), factor(subject, lamp) * subject.radius)


def in_the_open(lamp: LampChoice) -> LampChoice:
    """The lamp with the settings that are best for it where no room sends light back."""
    return replace(lamp, roulette=ROULETTE) if isinstance(lamp, RealLamp) else lamp


def elements(subject: Subject, lamp: LampChoice, folder: Path) -> list[ET.Element]:
    """The lamp about the origin."""
    x, y, z = subject.centre
    found = lamp.elements(folder, (-x, -y, -z))
    for element in found:
        move(element, (0.0, 0.0, 0.0), factor(subject, lamp))
    return found


def write(
    folder: Path, name: str, lamp: LampChoice, sensor: ET.Element, parts: list[Part],
    lamps: list[ET.Element],
) -> Path:  # fmt: skip
    """Write a scene and the meshes around the lamp; returns the XML's path."""
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    scene.append(sensor)
    scene.extend(write_parts(folder, name, parts))
    scene.extend(lamps)
    return write_xml(folder / f"{name}.xml", scene)


def pinhole(
    size: tuple[int, int], origin: tuple[float, ...], target: tuple[float, ...], fov: float,
    unit: float, up: str = "0, 0, 1",
) -> ET.Element:  # fmt: skip
    """A pinhole camera.

    Arguments:
        size: width and height in pixels, which share no light.
        origin, target: in units; `unit`: in m.
        fov: across the width, in degrees.
    """
    found = _sensor("perspective", size, fov, unit)
    at = {"origin": _text(origin, unit), "target": _text(target, unit), "up": up}
    ET.SubElement(ET.SubElement(found, "transform", name="to_world"), "lookat", at)
    return found


def lens(camera: Camera, fov: float) -> ET.Element:
    """A thin lens focused on the camera's target; a field of view in degrees."""
    found = _sensor("thinlens", (camera.size, camera.size), fov, camera.distance)
    for name in ("aperture_radius", "focus_distance"):
        value = camera.lens_radius if name == "aperture_radius" else camera.distance
        ET.SubElement(found, "float", name=name, value=repr(float(value)))
    at = {
        "origin": _text(tuple(camera.origin), 1), "target": _text(tuple(camera.target), 1),
        "up": _text(tuple(camera.axes[1]), 1),
    }  # fmt: skip
    ET.SubElement(ET.SubElement(found, "transform", name="to_world"), "lookat", at)
    return found


def _sensor(kind: str, size: tuple[int, int], fov: float, unit: float) -> ET.Element:
    found = ET.Element("sensor", type=kind)
    limits = {"fov": fov, "near_clip": 1e-3 * unit, "far_clip": 1e3 * unit}
    for name, value in limits.items():
        ET.SubElement(found, "float", name=name, value=repr(float(value)))
    film = ET.SubElement(found, "film", type="hdrfilm")
    for name, length in zip(("width", "height"), size, strict=True):
        ET.SubElement(film, "integer", name=name, value=str(length))
    for name, word in {"pixel_format": "rgb", "component_format": "float32"}.items():
        ET.SubElement(film, "string", name=name, value=word)
    ET.SubElement(film, "rfilter", type="box")
    ET.SubElement(found, "sampler", type="independent")
    return found


def _text(values: tuple[float, ...], unit: float) -> str:
    return ", ".join(repr(float(unit * v)) for v in values)
