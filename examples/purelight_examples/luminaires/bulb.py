"""A clear filament bulb, as many lamps hold several of: coil, leads, glass and socket."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import NICKEL, TUNGSTEN, Material, Part
from purelight_examples.luminaires.light import radiance
from purelight_examples.luminaires.materials import BK7
from purelight_examples.luminaires.parts import globe_profile, helix, revolve, shell, tube
from purelight_examples.luminaires.poses import Floats, copies, joined

GAP = 0.001  # between glass and socket


@dataclass(frozen=True)
class Bulb:
    """A bulb whose globe is centred at the origin, with its socket above; lengths in metres.

    Arguments:
        radius, neck: of the globe and of the neck.
        turns, coil, length, wire: of the filament, which lies along X.
        sections, steps: of the glass, around and along the globe.
    """

    radius: float = 0.028
    neck: float = 0.0105
    wall: float = 0.0012
    turns: int = 5
    coil: float = 0.0025
    length: float = 0.016
    wire: float = 0.0005
    sections: int = 28
    steps: int = 18

    @property
    def neck_top(self) -> float:
        """Height at which the glass ends."""
        return 1.5 * self.radius

    @property
    def top(self) -> float:
        """Height at which the socket ends."""
        return self.neck_top + 2.2 * self.neck

    @property
    def outer(self) -> float:
        """Radius of the socket."""
        return self.neck + 0.003

    def parts(self, poses: Sequence[Floats], lumens: float, kelvin: float, socket: Material,
              glass: Material = BK7) -> list[Part]:  # fmt: skip
        """Bulbs at some poses, which send out so many lumens each."""
        filament = copies(self.filament(), poses)
        light = radiance(lumens * len(poses), kelvin, filament.area)
        return [
            Part("filament", filament, TUNGSTEN, light),
            Part("leads", copies(self.leads(), poses), NICKEL),
            Part("bulb", copies(self.glass(), poses), glass),
            Part("socket", copies(self.socket(), poses), socket),
        ]

    def filament(self) -> trimesh.Trimesh:
        """The coil."""
        return tube(helix(self.turns, self.coil, self.length, 12), self.wire, sides=6)

    def leads(self) -> trimesh.Trimesh:
        """Two wires from beyond the filament's ends up into the neck."""
        across, high = 0.45 * (self.neck - self.wall), self.neck_top - self.wall - 0.001
        wires = []
        for side in (-1.0, 1.0):
            end, rise = 0.5 * self.length + 3 * self.wire, 0.5 * self.radius - self.coil
            path = [(side * end, 0, -self.coil), (side * (end + 0.001), 0, rise),
                    (side * across, 0, 0.9 * self.radius), (side * across, 0, high)]  # fmt: skip
            wires.append(tube(np.array(path), 0.7 * self.wire, sides=6))
        return joined(wires)

    def glass(self) -> trimesh.Trimesh:
        """The globe and its neck, hollow."""
        profile = globe_profile(self.radius, self.neck, self.neck_top, self.steps)
        return shell(profile, self.wall, self.sections)

    def socket(self) -> trimesh.Trimesh:
        """A cup over the neck, which it does not touch."""
        inner, low = self.neck + GAP, 1.2 * self.radius
        hollow = [[0, self.neck_top + GAP], [inner, self.neck_top + GAP], [inner, low]]
        rise = self.top - low
        wall = [[self.outer, low], [self.outer, low + 0.25 * rise],
                [0.9 * self.outer, low + 0.3 * rise], [0.9 * self.outer, self.top - 0.2 * rise],
                [0.7 * self.outer, self.top]]  # fmt: skip
        return revolve([*hollow, *wall, [0, self.top]], self.sections)
