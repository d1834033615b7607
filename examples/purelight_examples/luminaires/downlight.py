"""Downlight: an LED under a lens of total internal reflection, recessed behind a white trim."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import ACRYLIC, ALUMINIUM, BLACK, PHOSPHOR, WHITE
from purelight_examples.luminaires.optics import collimating_front, reflecting_side
from purelight_examples.luminaires.parts import above, revolve
from purelight_examples.luminaires.poses import Floats, turn

ACRYLIC_INDEX = 1.49


@dataclass(frozen=True)
class Downlight(Lamp):
    """A recessed spot: LED, TIR lens, dark baffle, trim. Its trim's lower face is at z = 0.

    Hard for a path tracer: all light goes through the lens, most of it by total reflection at its
    side, into a beam of some twenty degrees; from outside the beam nothing leads to the LED.

    Arguments:
        led: radius of the LED's phosphor.
        cavity, foot: radii of the lens's hollow around the LED and of its lower end.
        front: distance of the surface ahead of the LED.
        pillow: height of the bulges on the lens's face, which soften the beam.
        recess: of the lens behind the trim.
    """

    name: str = "downlight"
    led: float = 0.0035
    cavity: float = 0.007
    foot: float = 0.0085
    front: float = 0.009
    pillow: float = 0.0006
    recess: float = 0.03
    trim: float = 0.055
    lumens: float = 950.0
    kelvin: float = 3000.0

    def parts(self) -> list[Part]:
        """LED, lens, holder, heat sink, baffle, trim; built upwards, then hung upside down."""
        outline = self._lens()
        top = float(outline[:, 1].max())
        package = revolve([[0, -8e-4], [self.led, -8e-4], [self.led, -1e-4], [0, -1e-4]], 32)
        led = above(package, 1e-4)
        made = [
            Part("led", led, PHOSPHOR, radiance(self.lumens, self.kelvin, led.area), False),
            Part("package", package, WHITE),
            Part("lens", self._pillows(revolve(outline, 96), top), ACRYLIC),
            Part("holder", self._holder(), ALUMINIUM),
            Part("sink", self._sink(float(outline[:, 0].max())), ALUMINIUM),
            Part("baffle", self._baffle(top), BLACK),
            Part("trim", self._trim(top), WHITE),
        ]
        hang = turn("x", 180)
        hang[2, 3] = top + self.recess
        return [replace(p, mesh=p.mesh.copy().apply_transform(hang)) for p in made]

    def _lens(self) -> Floats:
        """The lens's outline from its hollow's middle around to its face's: [K, 2]."""
        front = collimating_front(ACRYLIC_INDEX, self.front, 0.97 * self.cavity)
        edge = float(np.arctan2(self.cavity, front[-1, 1]))
        side = reflecting_side(ACRYLIC_INDEX, self.cavity, self.foot, edge)
        r, top = side[-1]
        wall = [[self.cavity, front[-1, 1]], [self.cavity, 0.0]]
        face = [[r + 0.002, top], [r + 0.002, top + 0.002]]
        across = np.linspace(r, 0, 25)
        upper = np.stack((across, np.full(25, top + 0.002)), 1)
        return np.concatenate((front, wall, side, face, upper))

    def _pillows(self, lens: trimesh.Trimesh, top: float) -> trimesh.Trimesh:
        """The lens with rings and rays of bulges on its face."""
        x, y, z = lens.vertices.T
        r = np.hypot(x, y)
        bulge = 0.5 * (1 - np.cos(2 * np.pi * r / 0.006)) * np.minimum(r / 0.004, 1)
        face = (z > top - 1e-9) & (r < r.max() - 0.003)
        lens.vertices = np.stack((x, y, z + np.where(face, self.pillow * bulge, 0)), 1)
        return lens

    def _holder(self) -> trimesh.Trimesh:
        """A thin cup around the lens's side."""
        outline = self._lens()
        side = outline[len(outline) - 27 - 24 : len(outline) - 27]
        side = side[[0, 8, 14, 18, 21]] + (0.0025, 0.0)
        foot = [side[0] - (0, 0.0014)]
        return solids.lathe(solids.band(np.concatenate((foot, side)), 0.001), 64)

    def _sink(self, reach: float) -> trimesh.Trimesh:
        """A round heat sink below the LED, with fins."""
        z = -0.002
        profile: list[list[float]] = [[0, z], [reach, z]]
        for k in range(5):
            low = z - 0.006 * (k + 1)
            profile += [[reach, low + 0.0035], [0.5 * reach, low + 0.003],
                        [0.5 * reach, low + 0.001], [reach, low + 0.0005]]  # fmt: skip
        return revolve([*profile, [reach, z - 0.034], [0, z - 0.034]][::-1], 48)

    def _baffle(self, top: float) -> trimesh.Trimesh:
        """A dark cone from the lens to the trim."""
        r = self.trim - 0.012
        start = float(self._lens()[:, 0].max()) + 0.001
        profile = [[start, top - 0.002], [0.5 * (start + r), top + 0.4 * self.recess],
                   [r, top + self.recess - 0.004]]  # fmt: skip
        return solids.lathe(solids.band(profile, 0.0015), 64)

    def _trim(self, top: float) -> trimesh.Trimesh:
        """The ring that is seen from the room."""
        inner, outer, low = self.trim - 0.0105, self.trim, top + self.recess
        loop = [
            [inner, low - 0.012],
            [inner + 0.002, low - 0.012],
            [inner + 0.003, low - 0.003],
            [outer, low - 0.002],
            [outer, low - 0.0005],
            [outer - 0.002, low],
            [inner, low],
        ]
        return solids.lathe(loop, 72)  # fmt: skip
