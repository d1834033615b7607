"""The real lamp before an even background, path traced: whether it looks like a lamp at all."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.zoo.lamps import textures
from benchmarks.zoo.lamps.lamp import Lamp, enlarged
from benchmarks.zoo.lamps.plugin import plugin
from purelight_examples.luminaires.lamp_scene import write_xml
from purelight_format import atomic
from purelight_format.color import LUMINANCE
from purelight_mitsuba.scene_file import load_scene

RADIUS = 20.0  # metres: Mitsuba's ray epsilon is then a ten-thousandth of the lamp
BRIGHTER = 0.3  # background, over the mean radiance that the lamp would have as a sphere
Image = NDArray[np.float64]


def portrait(lamp: Lamp, size: int = 160, spp: int = 64) -> Image:
    """A picture of the lamp, lit by itself and by its background: [size, size, 3].

    Radiance is over that of the background.
    """
    import mitsuba as mi

    from purelight_format.measures import BoundingSphere
    from purelight_train.truth.thin_lens import ThinLens

    level = ambient(lamp)
    lens = ThinLens(BoundingSphere((0.0, 0.0, 0.0), RADIUS), size, 35.0, -12.0, aperture=1e-4)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = ET.Element("scene", version="3.0.0")
        scene.extend(lamp.elements(folder, enlarged(lamp, RADIUS)))
        scene.append(_sky(folder, level))
        loaded = load_scene(write_xml(folder / "portrait.xml", scene))
        camera = mi.load_dict(lens.sensor())
        integrator = mi.load_dict({"type": "volpath", "max_depth": 48, "rr_depth": 24})
        image = mi.render(loaded, sensor=camera, integrator=integrator, spp=spp)
    return np.array(image, np.float64)[..., :3] / level


def _sky(folder: Path, level: float) -> ET.Element:
    """Surroundings that darken towards the ground, with windows, so that metal and glass show."""
    picture = np.repeat(np.linspace(235, 120, 32)[:, None], 64, 1)
    picture[8:16, 4::16] = picture[8:16, 5::16] = picture[8:16, 6::16] = 40
    pixels = np.repeat(picture[..., None], 3, 2).astype(np.uint8)
    atomic.write_bytes(folder / "sky.png", textures.encoded(pixels))
    sky = plugin("emitter", "envmap", filename="sky.png", scale=level)
    ET.SubElement(sky, "transform", name="to_world").append(ET.Element("rotate", x="1", angle="90"))
    return sky


def ambient(lamp: Lamp) -> float:
    """A background that neither outshines the lamp nor is lost beside it, in W/(m² sr)."""
    power = sum(
        float(piece.triangles.area * (LUMINANCE @ piece.radiance))
        for piece in lamp.pieces if isinstance(piece.radiance, tuple)
    )  # fmt: skip
    power += sum(4 * float(LUMINANCE @ light.intensity) for light in lamp.lights)
    mean = power / (4 * np.pi * lamp.radius**2)
    return BRIGHTER * mean if mean > 0 else BRIGHTER
