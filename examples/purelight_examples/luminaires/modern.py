"""Modern: one bright bulb inside two rings of cut crystal."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.bulb import Bulb
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.luminaires.materials import CHROME, WHITE, glass
from purelight_examples.luminaires.parts import revolve, tube
from purelight_examples.luminaires.poses import around, copies, joined, shift

GAP = 0.0015
CRYSTAL = glass(1.6)


@dataclass(frozen=True)
class Modern(Lamp):
    """Crystal rods and drops in layers around one bright filament, after the paper's Modern.

    Hard for a path tracer: the filament is seen through its bulb and through one to four crystals
    of flat facets, each of which shows it elsewhere; the white dish and plate are lit through the
    crystals only and light them again.

    Arguments:
        inner, outer: number of crystals in each ring; the outer ones hang lower.
        near, far: radii of the rings.
        thick: radius of a crystal.
    """

    name: str = "modern"
    inner: int = 10
    outer: int = 18
    near: float = 0.075
    far: float = 0.125
    thick: float = 0.013
    lumens: float = 2200.0
    kelvin: float = 2900.0
    bulb: Bulb = field(
        default_factory=lambda: Bulb(radius=0.035, neck=0.013, length=0.022, turns=7, sections=40,
                                     steps=26)
    )  # fmt: skip

    def parts(self) -> list[Part]:
        """The bulb, the crystals on their pins, a plate above and a dish below."""
        high = self.bulb.top + GAP
        return [
            *self.bulb.parts([shift()], self.lumens, self.kelvin, CHROME),
            Part("crystals", self._crystals(high), CRYSTAL),
            Part("frame", self._frame(high), CHROME),
            Part("dish", self._dish(), WHITE),
            Part("rose", self._rose(high), WHITE),
        ]

    def _crystals(self, high: float) -> trimesh.Trimesh:
        top = high - 0.012
        inner = copies(_rod(self.thick, 0.12), around(self.inner, self.near, top))
        outer = copies(_rod(self.thick, 0.17), around(self.outer, self.far, top))
        drops = copies(_drop(0.8 * self.thick), around(self.outer, self.far, top - 0.17 - 0.006))
        return joined([inner, outer, drops])

    def _frame(self, high: float) -> trimesh.Trimesh:
        """A plate with a stem, and a pin above each crystal."""
        edge = self.far + 2 * self.thick
        low = high + 0.004
        plate = [
            [0, low],
            [edge, low],
            [edge, low + 0.008],
            [0.02, low + 0.01],
            [0.008, low + 0.03],
            [0.008, low + 0.1],
            [0, low + 0.1],
        ]
        pin = tube(np.outer([0, 0.004, 0.009], [0, 0, 1]), 0.0015, 6)
        poses = [*around(self.inner, self.near, high - 0.0105),
                 *around(self.outer, self.far, high - 0.0105)]  # fmt: skip
        return joined([revolve(plate, 72), copies(pin, poses)])

    def _dish(self) -> trimesh.Trimesh:
        """A shallow dish below the bulb, on three wires."""
        z, r = -self.bulb.radius - 0.03, 0.6 * self.near
        dish = [[0, z - 0.006], [0.6 * r, z - 0.005], [r, z + 0.002], [r, z + 0.004], [0.6 * r, z],
                [0, z - 0.001]]  # fmt: skip
        return revolve(dish, 60)

    def _rose(self, high: float) -> trimesh.Trimesh:
        """A white ring below the plate, between the bulb and the inner crystals."""
        inner, outer = self.bulb.outer + 0.004, self.near - self.thick - 0.004
        loop = [[inner, high - 0.004], [outer, high - 0.004], [outer, high], [inner, high]]
        return solids.lathe(loop, 72)


def _rod(radius: float, length: float) -> trimesh.Trimesh:
    """A six-sided crystal with pointed ends that hangs from the origin."""
    tip = 0.9 * radius
    rings = [(0.15 * radius, -length), (radius, tip - length), (radius, -tip), (0.3 * radius, 0.0)]
    return solids.gem([(r, 0.0, z) for r, z in rings], 6)


def _drop(radius: float) -> trimesh.Trimesh:
    """A cut drop that hangs from the origin."""
    rings = [
        (0.2, 0.0, -4.2),
        (0.8, 0.5, -3.6),
        (1.0, 0.0, -2.8),
        (0.7, 0.5, -1.6),
        (0.15, 0.0, 0.0),
    ]
    return solids.gem([(radius * r, turn, radius * z) for r, turn, z in rings], 8)
