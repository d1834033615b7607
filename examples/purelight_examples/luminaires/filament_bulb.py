"""A filament bulb: a coiled wire in a clear glass globe, hanging from a brass screw cap."""

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
    TUNGSTEN,
    WARM_WHITE,
    Part,
)
from purelight_examples.luminaires.parts import globe_profile, helix, screw_cap, shell, tube


@dataclass(frozen=True)
class FilamentBulb(Lamp):
    """A lamp bulb of the old kind, its globe about the origin and its cap on top.

    Hard for a path tracer: the coil is behind two clear surfaces, so that only reflections and
    refractions lead to it.

    Arguments:
        globe, wall, neck: radii of globe and neck, and the thickness of their glass.
        cap, cap_bottom: radius of the cap, and the height at which it begins.
        turns, coil, length, wire: of the filament, which lies along X.
        red: its radiance in W/(m² sr) in the red channel, at the colour of 2,800 K.
    """

    name: str = "filament_bulb"
    globe: float = 0.05
    wall: float = 0.002
    neck: float = 0.0125
    cap: float = 0.014
    cap_bottom: float = 0.064
    turns: int = 7
    coil: float = 0.004
    length: float = 0.036
    wire: float = 0.0008
    red: float = 1500.0

    def parts(self) -> list[Part]:
        """Coil, wires, glass, cap."""
        glass = shell(self.profile(), self.wall, sections=128)
        return [*self.glowing_coil(), Part("glass", glass, CLEAR_GLASS), self.screw_cap()]

    def glowing_coil(self) -> list[Part]:
        """The filament and the two wires that carry it from the cap."""
        path = helix(self.turns, self.coil, self.length, steps_per_turn=20)
        r, g, b = (self.red * np.array(WARM_WHITE)).tolist()
        leads = trimesh.util.concatenate([self._lead(path[0], -1.0), self._lead(path[-1], 1.0)])
        return [
            Part("filament", tube(path, self.wire, sides=10), TUNGSTEN, (r, g, b)),
            Part("leads", leads, NICKEL),
        ]

    def screw_cap(self) -> Part:
        """The brass cap that closes the globe's neck."""
        return Part("cap", screw_cap(self.cap_bottom, self.cap), BRASS)

    def profile(self, steps: int = 64) -> np.ndarray:
        """Outline of the globe and its neck, which ends inside the cap: [K, 2]."""
        return globe_profile(self.globe, self.neck, self.cap_bottom + 0.004, steps)

    def _lead(self, end: np.ndarray, side: float) -> trimesh.Trimesh:
        """A wire from just beyond an end of the filament up into the cap."""
        start = end + np.array([side * 1.6 * self.wire, 0.0, 0.0])
        bend = start + np.array([side * 0.002, 0.0, 0.004])
        neck = np.array([side * 0.4 * self.neck, 0.0, self.globe])
        top = np.array([side * 0.4 * self.neck, 0.0, self.cap_bottom + 0.002])
        return tube([start, bend, neck, top], 0.75 * self.wire, sides=8)


def parts() -> list[Part]:
    """The parts of the bulb as it is by default."""
    return FilamentBulb().parts()


def write(folder: Path) -> Path:
    """Write `filament_bulb.xml` and its meshes; returns the XML's path."""
    return FilamentBulb().write(folder)
