"""A lamp by itself before black, seen by the camera of `purelight-view`."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET

import numpy as np

from purelight_examples.scenes.lamp_choice import RealLamp
from purelight_format.camera import Camera


def view_scene(lamp: RealLamp, camera: Camera) -> ET.Element:
    """The lamp's shapes, its integrator and a sensor, for a scene file beside the lamp's.

    Arguments:
        camera: a pinhole camera; its rays are those of the sensor.
    """
    scene = ET.Element("scene", version="3.0.0")
    scene.append(lamp.integrator())
    scene.append(sensor(camera))
    scene.extend(lamp.elements(lamp.scene.parent, (0.0, 0.0, 0.0)))
    return scene


def sensor(camera: Camera) -> ET.Element:
    """The camera as a Mitsuba sensor."""
    sensor = ET.Element("sensor", type="perspective")
    fov = math.degrees(2 * math.atan(camera.half_width))
    limits = {
        "fov": fov, "near_clip": 1e-3 * camera.distance, "far_clip": 1e3 * camera.distance,
    }  # fmt: skip
    for name, value in limits.items():
        ET.SubElement(sensor, "float", name=name, value=repr(value))
    transform = ET.SubElement(sensor, "transform", name="to_world")
    at = {"origin": _text(camera.origin), "target": _text(camera.target), "up": "0, 0, 1"}
    ET.SubElement(transform, "lookat", at)
    film = ET.SubElement(sensor, "film", type="hdrfilm")
    for name in ("width", "height"):
        ET.SubElement(film, "integer", name=name, value=str(camera.size))
    ET.SubElement(film, "rfilter", type="box")
    return sensor


def _text(values: np.ndarray) -> str:
    return ", ".join(repr(float(v)) for v in values)
