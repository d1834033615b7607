"""Street light: an array of LEDs under wide-beam lenses behind flat glass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.lamp import Lamp
from purelight_examples.luminaires.lamp_scene import Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import ACRYLIC, BK7, PHOSPHOR, WHITE, glaze
from purelight_examples.luminaires.parts import above, revolve, tube
from purelight_examples.luminaires.poses import Floats, copies, joined, shift, turn

GREY = glaze((0.25, 0.26, 0.28), 0.2)


@dataclass(frozen=True)
class StreetLight(Lamp):
    """The head of a street light; the pole's arm comes along -X, the street lies along Y.

    Hard for a path tracer: two dozen LEDs of two millimetres, each under a lens that is dented in
    the middle and throws its light far along the street, and a sheet of glass in front of all.

    Arguments:
        rows, columns: of LEDs along X and Y, `pitch` apart.
        led: side of an LED.
        lens: radius of a lens along the street; across it, it is `stretch` times as long.
        dent: of its top, in parts of its height.
    """

    name: str = "street_light"
    rows: int = 6
    columns: int = 4
    pitch: float = 0.036
    led: float = 0.0022
    lens: float = 0.0105
    stretch: float = 1.45
    dent: float = 0.22
    lumens: float = 6000.0
    kelvin: float = 4000.0

    def parts(self) -> list[Part]:
        """LEDs, lenses and their board, the glass, and the housing; built face up, then turned."""
        half = (0.5 * self.rows * self.pitch + 0.012, 0.5 * self.columns * self.pitch + 0.012)
        places = [shift(*at, 0.0) for at in self._places()]
        block = trimesh.creation.box(extents=(self.led, self.led, 0.0008))
        block.apply_translation([0, 0, 0.0012])
        leds = copies(above(block, 0.0001), places)
        made = [
            Part("leds", leds, PHOSPHOR, radiance(self.lumens, self.kelvin, leds.area), False),
            Part("packages", copies(block, places), WHITE),
            Part("lenses", copies(self._lens(), places), ACRYLIC),
            Part("board", solids.prism(_rounded(*half, 0.006), -0.002, 0.0), WHITE),
            Part("cover", self._cover(half),
                 BK7),
            Part("housing", self._housing(half), GREY),
        ]  # fmt: skip
        hang = turn("x", 180)
        return [replace(p, mesh=p.mesh.copy().apply_transform(hang)) for p in made]

    def _places(self) -> list[tuple[float, float]]:
        x, y = (self.pitch * (np.arange(n) - 0.5 * (n - 1)) for n in (self.rows, self.columns))
        return [(float(a), float(b)) for a in x for b in y]

    def _lens(self) -> trimesh.Trimesh:
        """A dome with a dented top over a hollow; it stands on z = 0.0006.

        It is longer along X: where a dome is narrow it bends light further, along the street.
        """
        polar = np.linspace(0, 0.5 * np.pi, 19)
        dented = 1 - self.dent * np.exp(-((polar / 0.45) ** 2))
        outer = 0.8 * self.lens * dented[:, None] * np.stack((np.sin(polar), np.cos(polar)), 1)
        outer[:, 0] *= 1.25
        hollow = 0.36 * self.lens * np.stack((np.sin(polar[::-2]), 1.25 * np.cos(polar[::-2])), 1)
        outer[0, 0] = hollow[-1, 0] = 0.0
        body = revolve(np.concatenate((outer, hollow)), 32).apply_translation([0, 0, 6e-4])
        body.vertices = body.vertices * (self.stretch, 1, 1)
        return body

    def _cover(self, half: tuple[float, float]) -> trimesh.Trimesh:
        outline = _rounded(half[0] + 0.004, half[1] + 0.004, 0.01)
        return solids.prism(outline, 0.024, 0.028)

    def _housing(self, half: tuple[float, float]) -> trimesh.Trimesh:
        """A rim around the glass, a back with fins, and a sleeve for the arm."""
        x, y = half[0] + 0.02, half[1] + 0.02
        back = solids.prism(_rounded(x, y, 0.02), -0.012, -0.004)
        rim = _frame((x, y), 0.012, -0.003, 0.03)
        fin = trimesh.creation.box(extents=(1.6 * half[0], 0.003, 0.022))
        fins = copies(fin, [shift(0, dy, -0.0245) for dy in np.linspace(-0.8, 0.8, 11) * half[1]])
        sleeve = tube(
            [[-x - 0.002, 0, -0.012], [-x - 0.05, 0, -0.012], [-x - 0.1, 0, -0.012]], 0.02, 24
        )
        return joined([back, rim, fins, sleeve])


def _rounded(x: float, y: float, radius: float, steps: int = 6) -> Floats:
    """The outline of a rectangle of half sides x and y with round corners: [4 steps, 2]."""
    t = np.linspace(0, 0.5 * np.pi, steps)
    corner = radius * np.stack((np.cos(t), np.sin(t)), 1) + (x - radius, y - radius)
    turned = [corner, corner[::-1] * (-1, 1), -corner, corner[::-1] * (1, -1)]
    return np.concatenate(turned)


def _frame(half: tuple[float, float], width: float, low: float, high: float) -> trimesh.Trimesh:
    """An upright wall around a rounded rectangle, `width` thick."""
    outer = _rounded(*half, 0.02)
    inner = _rounded(half[0] - width, half[1] - width, 0.02 - 0.5 * width)
    loops = [(outer, low), (outer, high), (inner, high), (inner, low)]
    rings = np.stack([np.c_[loop, np.full(len(loop), z)] for loop, z in loops])
    return solids.looped(rings)
