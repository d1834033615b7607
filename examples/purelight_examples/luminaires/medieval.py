"""Medieval: a pierced lantern with hammered glass behind the holes."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.luminaires.materials import glass, matt_paint, tinted_metal
from purelight_examples.luminaires.parts import revolve
from purelight_examples.luminaires.pierced import on_prism, pierced, quatrefoil
from purelight_examples.luminaires.poses import joined, shift, turn

GAP = 0.0015
BRONZE = tinted_metal((0.3, 0.2, 0.12), 0.35)
ENAMEL = matt_paint((0.87, 0.84, 0.78))
AMBER = glass(tint=(0.995, 0.975, 0.93))
SIDES = 6
GLASS = 0.76  # radius of the glass over that of the corners


@dataclass(frozen=True)
class Medieval(Lamp):
    """A lantern of six pierced bronze walls around hammered glass, after the paper's Medieval.

    Hard for a path tracer: a filament behind two walls of glass, the outer one uneven, is seen
    through small holes only, and what meets the bronze goes back through the glass. The walls of a
    room get the sharp pattern of the holes, drawn out by the glass.

    Arguments:
        radius: of the corners; height: of the pierced walls.
        columns: of holes on each side; rows: of holes.
        open_to: radius of a hole in parts of half its cell, of `per_side` corners each way.
        ripple: depth of the glass's hammering, over `dents` around and along.
    """

    name: str = "medieval"
    radius: float = 0.09
    height: float = 0.2
    sheet: float = 0.0015
    columns: int = 3
    rows: int = 7
    open_to: float = 0.92
    per_side: int = 5
    glass_wall: float = 0.004
    ripple: float = 0.0008
    dents: tuple[int, int] = (16, 7)
    lumens: float = 1000.0
    kelvin: float = 2500.0
    bulb: Bulb = field(default_factory=lambda: Bulb(radius=0.032, length=0.02, turns=6))

    def parts(self) -> list[Part]:
        """The bulb, enamel plates below and above, glass, a pierced enamel liner, bronze."""
        cup_top = 0.008 - self._high
        stand = shift(z=cup_top + GAP + self.bulb.top) @ turn("x", 180)
        wide = 0.95 * (GLASS * self.radius - self.glass_wall)
        low = [[0, cup_top - 0.006], [wide, cup_top - 0.006], [wide, cup_top], [0, cup_top]]
        high = [[0, self._high - 0.006], [wide, self._high - 0.006], [wide, self._high],
                [0, self._high]]  # fmt: skip
        return [
            *self.bulb.parts([stand], self.lumens, self.kelvin, BRONZE),
            Part("plates", joined([revolve(low, 36), revolve(high, 36)]), ENAMEL),
            Part("glass", self._glass(), AMBER),
            Part("liner", self._walls(self.sheet + GAP, 1.03), ENAMEL),
            Part("walls", self._walls(0.0, 1.0), BRONZE),
            Part("roof", self._roof(), BRONZE),
        ]

    @property
    def _high(self) -> float:
        return 0.5 * self.height

    def _walls(self, inset: float, wider: float) -> trimesh.Trimesh:
        """Pierced walls, so far inside the outermost, with holes so many times as wide."""
        outer = self.radius - inset / np.cos(np.pi / SIDES)
        place = on_prism(SIDES, outer, outer - self.sheet, -self._high, self._high)
        return pierced(
            SIDES * self.columns, self.rows, quatrefoil(wider * self.open_to), place, self.per_side
        )

    def _glass(self) -> trimesh.Trimesh:
        """A tube, smooth inside and dented outside."""
        outer = GLASS * self.radius
        around, along = self.dents
        z = np.linspace(-self._high + 0.004, self._high - 0.004, 6 * along + 1)
        wall = np.full_like(z, outer - self.glass_wall)
        loop = np.concatenate((np.c_[np.full_like(z, outer), z], np.c_[wall, z][[-1, 0]]))
        tube = solids.lathe(loop, 8 * around)
        x, y, z = tube.vertices.T
        radius = np.hypot(x, y)
        dent = np.cos(around * np.arctan2(y, x)) * np.cos(np.pi * along * z / self._high)
        factor = np.where(radius > outer - 1e-6, 1 + self.ripple * dent / radius, 1.0)
        tube.vertices = np.stack((x * factor, y * factor, z), 1)
        return tube

    def _roof(self) -> trimesh.Trimesh:
        """A pyramid with a knob and a ring above the walls, and a floor with a drop below."""
        r, z = self.radius, self._high + GAP
        roof = [
            [0, z],
            [1.08 * r, z],
            [1.08 * r, z + 0.006],
            [0.75 * r, z + 0.035],
            [0.3 * r, z + 0.075],
            [0.12 * r, z + 0.085],
            [0.12 * r, z + 0.1],
            [0, z + 0.105],
        ]
        floor = [[0, -z - 0.03], [0.12 * r, -z - 0.024], [0.6 * r, -z - 0.01],
                 [1.05 * r, -z - 0.005], [1.05 * r, -z], [0, -z]]  # fmt: skip
        path = solids.circle(0.016, 24) @ np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0]])
        eye = solids.ring(path + np.array((0, 0, z + 0.105 + 0.019 + GAP)), 0.003, 8)
        return joined([revolve(roof, SIDES), revolve(floor, SIDES), eye])
