"""Vintage: a closed bowl of fluted rough glass and gold, with many bulbs in it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import TUNGSTEN, Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import GOLD, rough_glass
from purelight_examples.luminaires.parts import revolve, tube
from purelight_examples.luminaires.poses import Floats, around, copies, joined, shift, turn

GAP = 0.002


@dataclass(frozen=True)
class Vintage(Lamp):
    """A ceiling bowl after the paper's Vintage; `filaments` makes it Complex instead of Simple.

    Hard for a path tracer: light is reflected between gold and rough glass until it leaves. With
    large glowing balls a path from outside often meets one; with filaments in bulbs of clear glass
    it hardly ever does, and many bulbs glitter through the flutes.

    Arguments:
        radius, depth: of the bowl.
        rings: bulbs in each ring around the axis, from within.
        flutes: around the bowl, of `relief` in parts of its radius.
        ball: radius of the glowing balls of Simple.
        lumens: of each bulb.
    """

    name: str = "vintage_simple"
    filaments: bool = False
    radius: float = 0.19
    depth: float = 0.13
    rings: tuple[int, ...] = (5, 10)
    wall: float = 0.004
    flutes: int = 20
    relief: float = 0.03
    alpha: float = 0.1
    ball: float = 0.017
    lumens: float = 220.0
    kelvin: float = 2600.0
    bulb: Bulb = field(
        default_factory=lambda: Bulb(radius=0.017, neck=0.007, wall=0.001, turns=4, coil=0.002,
                                     length=0.012, wire=0.0004, sections=16, steps=10)
    )  # fmt: skip

    def parts(self) -> list[Part]:
        """The bulbs, the bowl, and its lid, ribs and finial."""
        return [
            *self._bulbs(),
            Part("bowl", self._bowl(), rough_glass(self.alpha, (0.99, 0.96, 0.9))),
            Part("gold", joined([self._lid(), self._beads(), self._ribs(), self._finial()]), GOLD),
        ]

    def _bulbs(self) -> list[Part]:
        """Bulbs that hang from the lid, evenly spread."""
        poses: list[Floats] = []
        for k, count in enumerate(self.rings):
            reach = 0.8 * self.radius * (k + 1) / (len(self.rings) + 0.4)
            poses += around(count, reach, -0.012)
        if self.filaments:
            return self.bulb.parts(poses, self.lumens, self.kelvin, GOLD)
        balls = copies(trimesh.creation.icosphere(subdivisions=3, radius=self.ball), poses)
        light = radiance(self.lumens * len(poses), self.kelvin, balls.area)
        socket = copies(self.bulb.socket(), [pose @ shift(z=0.002) for pose in poses])
        return [Part("balls", balls, TUNGSTEN, light), Part("socket", socket, GOLD)]

    def _outline(self, margin: float = 0.0) -> Floats:
        """The bowl from its lowest point to its rim: [K, 2]; `margin` outside of it."""
        t = np.linspace(0, 0.5 * np.pi, 33)
        across = (self.radius + margin) * np.sin(t) ** 0.9
        down = -(self.depth + margin) * np.cos(t) ** 1.1
        return np.stack((across, down), 1)

    def _bowl(self) -> trimesh.Trimesh:
        """A fluted cup: turned upside down, its wall inside the outline."""
        cup = solids.dome(self._outline() * (1, -1), self.wall, 6 * self.flutes)
        cup.apply_transform(turn("x", 180))
        x, y, z = cup.vertices.T
        high = np.clip(-z / self.depth, 0, 1)
        wave = np.cos(self.flutes * np.arctan2(y, x)) * np.sqrt(1 - high**2)
        factor = 1 + self.relief * (wave - 1)
        cup.vertices = np.stack((x * factor, y * factor, z), 1)
        return cup

    def _lid(self) -> trimesh.Trimesh:
        """A flat dome that closes over the bowl's rim, with a stem."""
        r, top = self.radius + 3 * GAP, self.bulb.top + 0.004
        inner = [[0, top], [0.9 * r, top], [r, top - 0.02], [r, -0.012]]
        outer = [[r + 0.003, -0.012], [r + 0.003, top - 0.016], [0.9 * r, top + 0.006],
                 [0.3 * r, top + 0.02], [0.05, top + 0.035], [0.009, top + 0.04],
                 [0.009, top + 0.1], [0, top + 0.1]]  # fmt: skip
        return revolve(inner + outer, 96)

    def _beads(self) -> trimesh.Trimesh:
        """A string of beads around the lid."""
        bead = trimesh.creation.icosphere(subdivisions=1, radius=0.006)
        return copies(bead, around(60, self.radius + 3 * GAP + 0.003 + 0.007, 0.002))

    def _ribs(self) -> trimesh.Trimesh:
        """Eight bands down the bowl's outside."""
        path = self._outline(0.006)[4:-4]
        rib = tube(np.c_[path[:, 0], np.zeros(len(path)), path[:, 1]], 0.003, 6)
        return copies(rib, around(8, 0.0))

    def _finial(self) -> trimesh.Trimesh:
        """The drop at the lowest point, and a small plate that the ribs end at."""
        z = -self.depth - GAP
        return revolve([[0, z - 0.045], [0.006, z - 0.04], [0.011, z - 0.03], [0.005, z - 0.02],
                        [0.012, z - 0.012], [0.03, z - 0.001], [0, z - 0.0005]], 40)  # fmt: skip
