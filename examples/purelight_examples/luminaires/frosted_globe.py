"""A frosted globe: the filament bulb's coil in a globe that is rough outside and smooth inside."""

from __future__ import annotations

from pathlib import Path

from purelight_examples.luminaires.filament_bulb import WALL, cap, glowing_coil, profile
from purelight_examples.luminaires.lamp_scene import CLEAR_GLASS, FROSTED_GLASS, Part, write_scene
from purelight_examples.luminaires.parts import inset, revolve


def parts() -> list[Part]:
    """The globe's parts; the inner surface faces the hollow, where its light comes from."""
    outline = profile(steps=48)
    inside = revolve(inset(outline, WALL), sections=96)
    inside.invert()
    glass = [
        Part("outside", revolve(outline, sections=96), FROSTED_GLASS),
        Part("inside", inside, CLEAR_GLASS),
    ]
    return [*glowing_coil(), *glass, cap()]


def write(folder: Path) -> Path:
    """Write `frosted_globe.xml` and its meshes; returns the XML's path."""
    return write_scene(folder, "frosted_globe", parts())
