"""A crystal lamp: LEDs on a metal column, in amber cut glass, in a thick clear crystal."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import (
    BRASS,
    CLEAR_GLASS,
    NICKEL,
    Material,
    Part,
    write_scene,
)
from purelight_examples.luminaires.parts import revolve, screw_cap, solid

RADIUS, INNER_RADIUS, HOLLOW = 0.05, 0.033, 0.72  # hollow in parts of the radius
COLUMN_RADIUS, COLUMN_HALF, LED_SIDE, LED_THICKNESS = 0.006, 0.016, 0.004, 0.001
LED = Material("diffuse", {}, {"reflectance": (0.7, 0.65, 0.5)})
LED_RADIANCE = (4000.0, 2600.0, 1400.0)  # about 4,000 K
AMBER_GLASS = Material(
    "dielectric",
    {"int_ior": 1.6, "ext_ior": 1.0},
    {"specular_transmittance": (0.97, 0.85, 0.6)},  # at each of its two faces
)
FACES, ROWS = 6, 3


def faceted(radius: float) -> trimesh.Trimesh:
    """A cut crystal about Z: the hull of twisted rings of points, flat at nadir and zenith."""
    rings = [(0.35, 0.0), (0.78, 0.5), (1.0, 0.0), (1.0, 0.5), (0.78, 0.0), (0.35, 0.5)]
    heights = [-0.94, -0.62, -0.15, 0.15, 0.62, 0.94]
    points = []
    for (across, twist), height in zip(rings, heights, strict=True):
        angle = 2 * np.pi * (np.arange(10) + twist) / 10
        points.append(np.c_[across * np.cos(angle), across * np.sin(angle), np.full(10, height)])
    hull = trimesh.Trimesh(radius * np.concatenate(points), process=False).convex_hull
    return solid(hull.vertices, hull.faces)


def cut_glass(radius: float) -> trimesh.Trimesh:
    """A cut crystal with a round hollow."""
    hollow = revolve(_sphere(HOLLOW * radius), 96)
    hollow.invert()
    return trimesh.util.concatenate([faceted(radius), hollow])


def parts() -> list[Part]:
    """The lamp's parts."""
    return [
        Part("leds", _leds(), LED, LED_RADIANCE),
        Part("column", _column(), NICKEL),
        Part("amber", cut_glass(INNER_RADIUS), AMBER_GLASS),
        Part("crystal", cut_glass(RADIUS), CLEAR_GLASS),
        Part("cap", screw_cap(0.9 * RADIUS, 0.014), BRASS),
    ]


def write(folder: Path) -> Path:
    """Write `crystal.xml` and its meshes; returns the XML's path."""
    return write_scene(folder, "crystal", parts())


def _sphere(radius: float) -> np.ndarray:
    polar = np.linspace(0, np.pi, 65)
    profile = radius * np.stack((np.sin(polar), -np.cos(polar)), 1)
    profile[[0, -1], 0] = 0.0
    return profile


def _column() -> trimesh.Trimesh:
    """A six-sided column that carries the LEDs, on a stem up into the cap."""
    foot = [[0.0, -COLUMN_HALF], [COLUMN_RADIUS, -COLUMN_HALF], [COLUMN_RADIUS, COLUMN_HALF]]
    stem = [[0.003, COLUMN_HALF + 0.002], [0.003, RADIUS], [0.0, RADIUS]]
    return revolve(foot + stem, FACES)


def _leds() -> trimesh.Trimesh:
    """Small blocks just off the middle of the column's faces."""
    apothem = COLUMN_RADIUS * np.cos(np.pi / FACES)
    size = (LED_THICKNESS, LED_SIDE, LED_SIDE)
    blocks = []
    for face in range(FACES):
        turn = trimesh.transformations.rotation_matrix(np.pi * (2 * face + 1) / FACES, [0, 0, 1])
        for height in np.linspace(-0.65, 0.65, ROWS) * COLUMN_HALF:
            block = trimesh.creation.box(extents=size)
            block.apply_translation((apothem + 0.0007 + LED_THICKNESS / 2, 0.0, height))
            blocks.append(block.apply_transform(turn))
    return trimesh.util.concatenate(blocks)
