"""A filament bulb: a coiled wire in a clear glass globe, hanging from a brass screw cap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import (
    BRASS,
    CLEAR_GLASS,
    NICKEL,
    TUNGSTEN,
    WARM_WHITE,
    Part,
    write_scene,
)
from purelight_examples.luminaires.parts import globe_profile, helix, screw_cap, shell, tube

GLOBE_RADIUS, WALL = 0.05, 0.002
NECK_RADIUS, CAP_RADIUS, CAP_BOTTOM = 0.0125, 0.014, 0.064
COIL_TURNS, COIL_RADIUS, COIL_LENGTH, WIRE_RADIUS = 7, 0.004, 0.036, 0.0008
RED_RADIANCE = 1500.0


def glowing_coil() -> list[Part]:
    """The filament and the two wires that carry it from the cap."""
    path = helix(COIL_TURNS, COIL_RADIUS, COIL_LENGTH, steps_per_turn=20)
    radiance = RED_RADIANCE * np.array(WARM_WHITE)
    r, g, b = radiance.tolist()
    leads = trimesh.util.concatenate([_lead(path[0], -1.0), _lead(path[-1], 1.0)])
    return [
        Part("filament", tube(path, WIRE_RADIUS, sides=10), TUNGSTEN, (r, g, b)),
        Part("leads", leads, NICKEL),
    ]


def cap() -> Part:
    """The brass screw cap that closes the globe's neck."""
    return Part("cap", screw_cap(CAP_BOTTOM, CAP_RADIUS), BRASS)


def profile(steps: int = 64) -> np.ndarray:
    """Outline of the globe and its neck, which ends inside the cap: [K, 2]."""
    return globe_profile(GLOBE_RADIUS, NECK_RADIUS, CAP_BOTTOM + 0.004, steps)


def parts() -> list[Part]:
    """The bulb's parts."""
    glass = Part("glass", shell(profile(), WALL, sections=128), CLEAR_GLASS)
    return [*glowing_coil(), glass, cap()]


def write(folder: Path) -> Path:
    """Write `filament_bulb.xml` and its meshes; returns the XML's path."""
    return write_scene(folder, "filament_bulb", parts())


def _lead(end: np.ndarray, side: float) -> trimesh.Trimesh:
    """A wire from just beyond an end of the filament up into the cap."""
    start = end + np.array([side * 1.6 * WIRE_RADIUS, 0.0, 0.0])
    bend = start + np.array([side * 0.002, 0.0, 0.004])
    neck = np.array([side * 0.005, 0.0, 0.05])
    top = np.array([side * 0.005, 0.0, CAP_BOTTOM + 0.002])
    return tube([start, bend, neck, top], 0.0006, sides=8)
