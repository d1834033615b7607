"""Linear LED: a row of LEDs in a white channel behind a prismatic cover."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import ACRYLIC, PHOSPHOR, WHITE
from purelight_examples.luminaires.parts import above
from purelight_examples.luminaires.poses import copies, shift, turn


@dataclass(frozen=True)
class LinearLed(Lamp):
    """An office light, its long side along X and its opening down.

    Hard for a path tracer: each LED is three millimetres wide and comes as dozens of images out of
    the prisms, which send back what meets them too steeply.

    Arguments:
        length, width, height: of the channel; wall: its thickness.
        leds: along the row, each a square of side `led`.
        prism: side of the pyramids of the cover, which are half as high.
    """

    name: str = "linear_led"
    length: float = 0.6
    width: float = 0.07
    height: float = 0.04
    wall: float = 0.002
    leds: int = 20
    led: float = 0.003
    prism: float = 0.006
    lumens: float = 1800.0
    kelvin: float = 4000.0

    def parts(self) -> list[Part]:
        """LEDs on their board, the channel, and the cover in its opening."""
        half = (0.5 * self.length, 0.5 * self.width, 0.5 * self.height)
        ceiling = half[2] - self.wall
        block = trimesh.creation.box(extents=(self.led, self.led, 0.001))
        across = (self.length - 0.02) * ((np.arange(self.leds) + 0.5) / self.leds - 0.5)
        places = [shift(x, 0, ceiling - 0.0045) @ turn("x", 180) for x in across]
        leds = copies(above(block, 0.0001), places)
        board = trimesh.creation.box(extents=(self.length - 0.012, 0.012, 0.0015))
        return [
            Part("leds", leds, PHOSPHOR, radiance(self.lumens, self.kelvin, leds.area), False),
            Part("packages", copies(block, places), WHITE),
            Part("board", board.apply_translation([0, 0, ceiling - 0.0025]), WHITE),
            Part("channel", solids.tray(half, self.wall), WHITE),
            Part("cover", self._cover(-half[2] + 0.001), ACRYLIC),
        ]

    def _cover(self, low: float) -> trimesh.Trimesh:
        """A plate, flat above and all pyramids below: a tent along X and one along Y, added."""
        sides = [side - 2 * self.wall - 0.002 for side in (self.length, self.width)]
        count = [2 * round(side / self.prism) for side in sides]
        x, y = (
            np.linspace(-0.5 * side, 0.5 * side, n + 1)
            for side, n in zip(sides, count, strict=True)
        )
        i, j = np.meshgrid(*(np.arange(n + 1) for n in count), indexing="ij")
        deep = 0.25 * self.prism * (i % 2 + j % 2)
        flat = np.stack(np.meshgrid(x, y, indexing="ij"), -1)
        top = low + 0.5 * self.prism + 0.002
        lower = np.concatenate((flat, (low + 0.5 * self.prism - deep)[..., None]), -1)
        upper = np.concatenate((flat, np.full((*i.shape, 1), top)), -1)
        return solids.between(upper, lower)
