"""A matt floor below a lamp, as a task of the benchmark, and its irradiance by quadrature."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.protocol import Subject
from purelight_examples.scenes.lamp_choice import LampChoice

SCENE = """<scene version="3.0.0">
  <sensor type="perspective"><float name="fov" value="60"/>
    <transform name="to_world">
      <lookat origin="0, -0.6, {up}" target="0, 0, {down}" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><integer name="width" value="{size}"/>
      <integer name="height" value="{size}"/><rfilter type="box"/></film></sensor>
  <shape type="rectangle">
    <transform name="to_world"><scale value="20"/><translate z="{down}"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5, 0.4, 0.3"/></bsdf></shape>
</scene>"""


@dataclass(frozen=True)
class Floor:
    """A floor at `height` below the lamp, seen from between them."""

    size: int = 12
    height: float = 0.5
    name: str = "floor"
    kind: str = "illumination"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """The floor, the lamp and its integrator."""
        text = SCENE.format(up=-0.1, down=-self.height, size=self.size)
        scene = ET.fromstring(text)
        scene.append(lamp.integrator())
        scene.extend(lamp.elements(folder, (0.0, 0.0, 0.0)))
        path = folder / "floor.xml"
        ET.ElementTree(scene).write(path)
        return path

    def truth(self, radiance: tuple[float, float, float], radius: float) -> NDArray[np.float64]:
        r"""Radiance of the floor under a sphere: :math:`\rho L (r/d)^2 \cos\theta`."""
        import mitsuba as mi

        black = ET.fromstring(SCENE.format(up=-0.1, down=-self.height, size=self.size))
        sensor = mi.load_string(ET.tostring(black, "unicode")).sensors()[0]
        place = (np.arange(self.size * 8) + 0.5) / (self.size * 8)
        x, y = (a.ravel() for a in np.meshgrid(place, place))
        ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
        origin, direction = np.array(ray.o).T, np.array(ray.d).T
        t = (-self.height - origin[:, 2]) / direction[:, 2]
        point = origin + t[:, None] * direction
        square = (point**2).sum(1)
        lit = (radius**2 / square) * (self.height / np.sqrt(square))
        image = lit[:, None] * np.array(radiance) * np.array([0.5, 0.4, 0.3])
        blocks = image.reshape(self.size, 8, self.size, 8, 3)
        mean: NDArray[np.float64] = blocks.mean((1, 3))
        return mean
