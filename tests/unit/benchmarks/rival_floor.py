"""A matt sphere above a matt floor, as a subject and a task of the benchmark of systems."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.protocol import Subject
from purelight_examples.scenes.lamp_choice import LampChoice

RADIANCE, RADIUS, CENTRE = (300.0, 200.0, 100.0), 0.05, (0.01, -0.02, 0.03)
FLUX = tuple((4 * np.pi**2 * RADIUS**2 * np.array(RADIANCE)).tolist())
ALBEDO = (0.5, 0.4, 0.3)
FINE = 8  # points along a pixel of the truth

LAMP = """<scene version="3.0.0">
  <shape type="sphere"><float name="radius" value="{radius}"/>
    <point name="center" value="{centre}"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="{radiance}"/></emitter></shape>
  {more}
</scene>"""

SCENE = """<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="60"/>
    <transform name="to_world">
      <lookat origin="0, -0.6, -0.1" target="0, 0, -{height}" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="{width}"/>
      <integer name="height" value="{rows}"/><rfilter type="box"/></film></sensor>
  <shape type="rectangle">
    <transform name="to_world"><scale value="20"/><translate z="-{height}"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="{albedo}"/></bsdf></shape>
</scene>"""


def subject(folder: Path, more: str = "", radius: float = RADIUS) -> Subject:
    """The sphere, and more shapes around it if wanted, in a scene file; no run and no bundle.

    Arguments:
        radius: of the glowing sphere.
    """
    path = folder / "lamp.xml"
    values = {"centre": _text(CENTRE), "radiance": _text(RADIANCE)}
    path.write_text(LAMP.format(radius=radius, more=more, **values))
    run, bundle = folder / "run", folder / "lamp.plux"
    r, g, b = FLUX
    return Subject("lamp", path, run, bundle, CENTRE, RADIUS, (r, g, b))


@dataclass(frozen=True)
class Floor:
    """A floor below the lamp, seen from between them, a little wider than high."""

    width: int = 12
    rows: int = 10
    height: float = 0.5
    name: str = "floor"
    kind: str = "illumination"

    @property
    def empty(self) -> str:
        """The scene without the lamp."""
        size = {"width": self.width, "rows": self.rows, "height": self.height}
        return SCENE.format(albedo=_text(ALBEDO), **size)

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """The floor, the lamp about the origin, and its integrator."""
        scene = ET.fromstring(self.empty)
        scene.append(lamp.integrator())
        x, y, z = subject.centre
        scene.extend(lamp.elements(folder, (-x, -y, -z)))
        path = folder / "floor.xml"
        ET.ElementTree(scene).write(path)
        return path

    def truth(self) -> NDArray[np.float64]:
        r"""Radiance of the floor under a sphere: :math:`\rho L (r/d)^2 \cos\theta`."""
        import mitsuba as mi

        sensor = mi.load_string(self.empty).sensors()[0]
        across, down = ((np.arange(n * FINE) + 0.5) / (n * FINE) for n in (self.width, self.rows))
        x, y = (a.ravel() for a in np.meshgrid(across, down))
        ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
        origin, direction = np.array(ray.o).T, np.array(ray.d).T
        point = origin + (-self.height - origin[:, 2:]) / direction[:, 2:] * direction
        square = (point**2).sum(1)
        part = RADIUS**2 / square * (self.height / np.sqrt(square))
        image = part[:, None] * np.array(RADIANCE) * np.array(ALBEDO)
        blocks = image.reshape(self.rows, FINE, self.width, FINE, 3)
        mean: NDArray[np.float64] = blocks.mean((1, 3))
        return mean


def _text(values: tuple[float, ...]) -> str:
    return ", ".join(map(str, values))
