"""A crystal lamp: LEDs on a metal column, in amber cut glass, in a thick clear crystal."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import (
    BRASS,
    CLEAR_GLASS,
    NICKEL,
    RGB,
    Material,
    Part,
)
from purelight_examples.luminaires.parts import revolve, screw_cap, solid

LED = Material("diffuse", {}, {"reflectance": (0.7, 0.65, 0.5)})
AMBER_GLASS = Material(
    "dielectric",
    {"int_ior": 1.6, "ext_ior": 1.0},
    {"specular_transmittance": (0.97, 0.85, 0.6)},  # at each of its two faces
)


@dataclass(frozen=True)
class Crystal(Lamp):
    """Cut glass in cut glass on a screw cap, after the paper's Crystal.

    Hard for a path tracer: LEDs of four millimetres are seen through four refracting surfaces, two
    of them of flat facets, each of which shows them elsewhere.

    Arguments:
        radius, inner: of the clear and of the amber crystal.
        hollow: of each, in parts of its radius.
        column, half: radius and half-height of the column that carries the LEDs.
        led, thick: side and thickness of an LED; `faces` around the column, in `rows`.
        radiance: of the LEDs in W/(m² sr), about 4,000 K.
    """

    name: str = "crystal"
    radius: float = 0.05
    inner: float = 0.033
    hollow: float = 0.72
    column: float = 0.006
    half: float = 0.016
    led: float = 0.004
    thick: float = 0.001
    faces: int = 6
    rows: int = 3
    radiance: RGB = (4000.0, 2600.0, 1400.0)

    def parts(self) -> list[Part]:
        """LEDs, column, crystals, cap."""
        return [
            Part("leds", self._leds(), LED, self.radiance),
            Part("column", self._column(), NICKEL),
            Part("amber", self._cut_glass(self.inner), AMBER_GLASS),
            Part("crystal", self._cut_glass(self.radius), CLEAR_GLASS),
            Part("cap", screw_cap(0.9 * self.radius, 0.014), BRASS),
        ]

    def _cut_glass(self, radius: float) -> trimesh.Trimesh:
        """A cut crystal with a round hollow."""
        hollow = revolve(_sphere(self.hollow * radius), 96)
        hollow.invert()
        return trimesh.util.concatenate([faceted(radius), hollow])

    def _column(self) -> trimesh.Trimesh:
        """A column that carries the LEDs, on a stem up into the cap."""
        r, h = self.column, self.half
        stem = [[0.5 * r, h + 0.002], [0.5 * r, self.radius], [0.0, self.radius]]
        return revolve([[0.0, -h], [r, -h], [r, h], *stem], self.faces)

    def _leds(self) -> trimesh.Trimesh:
        """Small blocks just off the middle of the column's faces."""
        apothem = self.column * np.cos(np.pi / self.faces)
        blocks = []
        for face in range(self.faces):
            angle = np.pi * (2 * face + 1) / self.faces
            turn = trimesh.transformations.rotation_matrix(angle, [0, 0, 1])
            for height in np.linspace(-0.65, 0.65, self.rows) * self.half:
                block = trimesh.creation.box(extents=(self.thick, self.led, self.led))
                block.apply_translation((apothem + 0.0007 + self.thick / 2, 0.0, height))
                blocks.append(block.apply_transform(turn))
        return trimesh.util.concatenate(blocks)


def faceted(radius: float) -> trimesh.Trimesh:
    """A cut crystal about Z: the hull of twisted rings of points, flat at nadir and zenith."""
    rings = [(0.35, 0.0), (0.78, 0.5), (1.0, 0.0), (1.0, 0.5), (0.78, 0.0), (0.35, 0.5)]
    heights = [-0.94, -0.62, -0.15, 0.15, 0.62, 0.94]
    points = []
    for (across, twist), height in zip(rings, heights, strict=True):
        angle = 2 * np.pi * (np.arange(10) + twist) / 10
        points.append(np.c_[across * np.cos(angle), across * np.sin(angle), np.full(10, height)])
    hull = trimesh.Trimesh(radius * np.concatenate(points), process=False).convex_hull
    return solid(hull.vertices, hull.faces)


def _sphere(radius: float) -> np.ndarray:
    polar = np.linspace(0, np.pi, 65)
    profile = radius * np.stack((np.sin(polar), -np.cos(polar)), 1)
    profile[[0, -1], 0] = 0.0
    return profile


def parts() -> list[Part]:
    """The parts of the lamp as it is by default."""
    return Crystal().parts()


def write(folder: Path) -> Path:
    """Write `crystal.xml` and its meshes; returns the XML's path."""
    return Crystal().write(folder)
