"""Wall sconce: a half round of fluted frosted glass on a brass plate, open above and below."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import BRASS, Part
from purelight_examples.luminaires.materials import rough_glass
from purelight_examples.luminaires.parts import tube
from purelight_examples.luminaires.poses import joined, shift

GAP = 0.002
OFF = 0.014  # of the glass from the wall


@dataclass(frozen=True)
class WallSconce(Lamp):
    """A lamp for a wall at x = 0, into the room along +X.

    Hard for a path tracer: two filaments behind their bulbs and rough fluted glass; and hard for a
    method that needs shading points outside of the lamp's sphere, for the wall crosses it.

    Arguments:
        radius, height: of the glass; wall: its thickness.
        flutes: around the half round, each as deep as `relief`.
        apart: from bulb to bulb.
    """

    name: str = "wall_sconce"
    radius: float = 0.075
    height: float = 0.26
    wall: float = 0.004
    flutes: int = 14
    relief: float = 0.003
    alpha: float = 0.2
    apart: float = 0.1
    lumens: float = 380.0
    kelvin: float = 2700.0
    bulb: Bulb = field(
        default_factory=lambda: Bulb(radius=0.021, neck=0.009, sections=24, steps=16)
    )

    def parts(self) -> list[Part]:
        """Two bulbs, the glass, and the brass that holds them."""
        low = -0.5 * self.bulb.top
        places = [(OFF + 0.5 * self.radius, low + s * 0.5 * self.apart) for s in (-1, 1)]
        poses = [shift(x, 0.0, z) for x, z in places]
        arms = [self._arm(x, z + self.bulb.top + GAP) for x, z in places]
        return [
            *self.bulb.parts(poses, self.lumens, self.kelvin, BRASS),
            Part("glass", self._glass(), rough_glass(self.alpha)),
            Part("brass", joined([self._plate(), *arms, *self._hoops()]), BRASS),
        ]

    def _glass(self) -> trimesh.Trimesh:
        """A half tube whose outside is fluted."""
        angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 8 * self.flutes + 1)
        z = np.linspace(-0.5, 0.5, 25) * self.height
        outer = self.radius + self.relief * np.abs(np.cos(self.flutes * angle))
        inner = np.full_like(angle, self.radius - self.wall)
        faces = [
            np.stack(np.broadcast_arrays(
                OFF + (r * np.cos(angle))[:, None], (r * np.sin(angle))[:, None], z), -1)
            for r in (outer, inner)
        ]  # fmt: skip
        return solids.between(*faces)

    def _plate(self) -> trimesh.Trimesh:
        plate = trimesh.creation.box(extents=(0.006, 1.6 * self.radius, 1.12 * self.height))
        return plate.apply_translation([0.003, 0, 0])

    def _arm(self, x: float, z: float) -> trimesh.Trimesh:
        """A bent tube from the plate to above a socket that ends at z."""
        start = (0.006 + GAP, 0, z + 0.012)
        path = [start, (x - 0.012, 0, z + 0.012), (x - 0.003, 0, z + 0.009), (x, 0, z)]
        return tube(np.array(path), 0.0035, 12)

    def _hoops(self) -> list[trimesh.Trimesh]:
        """Half rings around the glass near its ends."""
        angle = np.linspace(-0.47 * np.pi, 0.47 * np.pi, 33)
        reach = self.radius + self.relief + 0.003 + GAP
        hoops = []
        for side in (-1, 1):
            z = np.full_like(angle, side * 0.46 * self.height)
            path = np.stack((OFF + reach * np.cos(angle), reach * np.sin(angle), z), 1)
            hoops.append(tube(path, 0.003, 10))
        return hoops
