"""A frosted globe: the filament bulb's coil in a globe that is rough outside and smooth inside."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from purelight_examples.luminaires.filament_bulb import FilamentBulb
from purelight_examples.luminaires.lamp_scene import CLEAR_GLASS, FROSTED_GLASS, Part
from purelight_examples.luminaires.parts import inset, revolve


@dataclass(frozen=True)
class FrostedGlobe(FilamentBulb):
    """The filament bulb with etched glass.

    Hard for a path tracer: a coil behind rough glass, at which it cannot aim.
    """

    name: str = "frosted_globe"

    def parts(self) -> list[Part]:
        """Coil, wires, cap, and glass, whose inner surface faces the hollow."""
        outline = self.profile(steps=48)
        inside = revolve(inset(outline, self.wall), sections=96)
        inside.invert()
        glass = [
            Part("outside", revolve(outline, sections=96), FROSTED_GLASS),
            Part("inside", inside, CLEAR_GLASS),
        ]
        return [*self.glowing_coil(), *glass, self.screw_cap()]


def parts() -> list[Part]:
    """The parts of the globe as it is by default."""
    return FrostedGlobe().parts()


def write(folder: Path) -> Path:
    """Write `frosted_globe.xml` and its meshes; returns the XML's path."""
    return FrostedGlobe().write(folder)
