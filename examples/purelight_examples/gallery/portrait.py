"""A real lamp by daylight, path traced: how it is built."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_examples.luminaires.catalog import Entry
from purelight_examples.luminaires.lamp_scene import write_xml
from purelight_examples.rendering import Image
from purelight_examples.scenes.lamp_view import sensor
from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere
from purelight_mitsuba.platform import reading

RADIUS = (
    20.0  # metres that the lamp is enlarged to: Mitsuba's lift of rays is a tenth of a millimetre
)
DEPTH = 48
SKY = ((0.9, 0.95, 1.0), (0.25, 0.24, 0.23))  # radiance from above and from below, W/(m² sr)


def portrait(scene: Path, entry: Entry, sphere: BoundingSphere, size: int, spp: int) -> Image:
    """A picture [size, size, 3] of a lamp that is switched off, with the sky behind it.

    Arguments:
        scene: of the lamp, whose folder receives another one.
        sphere: that holds the lamp.
    """
    world = BoundingSphere((0.0, 0.0, 0.0), RADIUS)
    camera = Camera.orbit(world, azimuth=entry.azimuth, elevation=entry.elevation, size=size)
    root = ET.Element("scene", version="3.0.0")
    root.append(sensor(camera))
    root.extend(_enlarged(scene, sphere))
    with reading():
        loaded = mi.load_file(str(write_xml(scene.with_name("portrait.xml"), root)))
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    sky = {"type": "envmap", "bitmap": _sky(), "to_world": upright}
    lit = mi.load_dict({"type": "scene", "sky": sky, **_shapes(loaded)})
    integrator = mi.load_dict({"type": "path", "max_depth": DEPTH, "rr_depth": DEPTH // 2})
    image = mi.render(lit, sensor=loaded.sensors()[0], integrator=integrator, spp=spp)
    return np.array(image, np.float64)[..., :3]


def _shapes(scene: Any) -> dict[str, Any]:
    return {f"shape_{k}": shape for k, shape in enumerate(scene.shapes())}


def _enlarged(scene: Path, sphere: BoundingSphere) -> list[ET.Element]:
    """The lamp's shapes without their emitters, about the origin."""
    shapes = []
    for shape in ET.parse(scene).getroot().iter("shape"):
        dark = copy.deepcopy(shape)
        for emitter in dark.findall("emitter"):
            dark.remove(emitter)
        transform = ET.SubElement(dark, "transform", name="to_world")
        back = ", ".join(f"{-c:.9g}" for c in sphere.center)
        ET.SubElement(transform, "translate", value=back)
        ET.SubElement(transform, "scale", value=f"{RADIUS / sphere.radius:.9g}")
        shapes.append(dark)
    return shapes


def _sky(height: int = 64) -> Any:
    """Grey, brighter above, with a bright window on each of three sides: [height, 2 height, 3]."""
    above, below = np.array(SKY)
    part = np.clip(np.linspace(1.35, -0.35, height), 0, 1)[:, None, None]
    picture = np.repeat(part * above + (1 - part) * below, 2 * height, 1)
    columns = np.arange(2 * height) % (2 * height // 3)
    window = (columns > 8) & (columns < 18)
    picture[height // 5 : height // 2 - 4, window] = 4.0
    return mi.Bitmap(picture.astype(np.float32))
