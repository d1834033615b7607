"""Table lamp: a pleated fabric shade over an opal bulb on a glazed foot."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import BRASS, RGB, Part
from purelight_examples.luminaires.materials import fabric, glaze, rough_glass
from purelight_examples.luminaires.parts import revolve, tube
from purelight_examples.luminaires.poses import around, copies, joined, shift, turn

GAP = 0.0015
OPAL = rough_glass(0.35)


@dataclass(frozen=True)
class TableLamp(Lamp):
    """A lamp that stands on z = 0.

    Hard for a path tracer: the filament is behind an etched bulb inside of a thin cloth that
    passes a part of the light, reflects another, and is seen from inside and outside.

    Arguments:
        height: of the shade's upper edge; deep: of the shade.
        low, high: radii of the shade below and above.
        pleats: around it, of `relief` in parts of its radius.
        through: of the cloth, see `materials.fabric`.
        color: of the foot's glaze.
    """

    name: str = "table_lamp"
    height: float = 0.46
    deep: float = 0.19
    low: float = 0.16
    high: float = 0.11
    pleats: int = 48
    relief: float = 0.012
    through: float = 1.1
    color: RGB = (0.05, 0.16, 0.22)
    lumens: float = 800.0
    kelvin: float = 2700.0
    bulb: Bulb = field(
        default_factory=lambda: Bulb(radius=0.03, neck=0.0125, turns=6, length=0.02, sections=36,
                                     steps=24)
    )  # fmt: skip

    def parts(self) -> list[Part]:
        """The bulb, cloth and frame of the shade, and the foot."""
        middle = self.height - 0.55 * self.deep
        foot_top = middle - self.bulb.top - GAP
        stand = shift(z=middle) @ turn("x", 180)
        return [
            *self.bulb.parts([stand], self.lumens, self.kelvin, BRASS, OPAL),
            Part("shade", self._shade(), fabric((0.86, 0.8, 0.68), self.through), solid=False),
            Part("frame", self._frame(foot_top), BRASS),
            Part("foot", self._foot(foot_top), glaze(self.color)),
        ]

    def _radius(self, z: float) -> float:
        """Of the shade at a height."""
        part = (z - (self.height - self.deep)) / self.deep
        return self.low + (self.high - self.low) * part

    def _shade(self) -> trimesh.Trimesh:
        z = np.linspace(self.height - self.deep, self.height, 9)
        profile = np.stack((np.array([self._radius(h) for h in z]), z), 1)
        sheet, _ = solids.sheet(profile, 8 * self.pleats, self.pleats, self.relief)
        sheet.merge_vertices()
        return sheet

    def _frame(self, foot_top: float) -> trimesh.Trimesh:
        """Two hoops inside the shade, three spokes to a collar, and the collar's stem."""
        inside = 1 - self.relief
        hoops = []
        for z in (self.height - self.deep + 0.006, self.height - 0.006):
            hoops.append(
                solids.ring(solids.circle(inside * self._radius(z) - 0.004, 96, z), 0.0018, 8)
            )
        z = self.height - 0.006
        reach = inside * self._radius(z) - 0.004 - 0.0018 - GAP
        spoke = tube([[0.012, 0, 0], [0.5 * reach, 0, 0], [reach, 0, 0]], 0.0014, 6)
        spokes = copies(spoke, [pose @ shift(z=z) for pose in around(3, 0.0)])
        hub = revolve([[0, z - 0.004], [0.0105, z - 0.004], [0.0105, z + 0.004], [0.004, z + 0.012],
                       [0.006, z + 0.018], [0, z + 0.022]], 24)  # fmt: skip
        stem = revolve([[0, foot_top - 0.045], [0.014, foot_top - 0.045],
                        [0.009, foot_top - 0.03], [0.009, foot_top - 0.01], [0.016, foot_top],
                        [0, foot_top]], 32)  # fmt: skip
        return joined([*hoops, spokes, hub, stem])

    def _foot(self, foot_top: float) -> trimesh.Trimesh:
        """A turned vase on a plinth."""
        top = foot_top - 0.045 - GAP
        t = np.linspace(0, 1, 33)
        belly = 0.018 + 0.052 * np.sin(np.pi * t**0.8) ** 1.5 + 0.03 * (1 - t) ** 6
        vase = np.stack((belly, 0.012 + (top - 0.012) * t), 1)
        profile = [
            [0, 0],
            [0.068, 0],
            [0.072, 0.004],
            [0.07, 0.01],
            [0.05, 0.012],
            *vase[1:],
            [0, top],
        ]
        return revolve(profile, 64)
