"""Five lamps that show their finishes: opaque shade, metal, clear globe, frosted globe, crystal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires import crystal, filament_bulb, frosted_globe
from purelight_examples.luminaires.lamp_scene import (
    RGB,
    WARM_WHITE,
    Material,
    Part,
    write_scene,
)
from purelight_examples.luminaires.parts import tube

SECTIONS = 64
BULB_RADIANCE = 400.0


def two_sided(reflectance: RGB) -> Material:
    """Paint on both sides of a sheet."""
    return Material("diffuse", {}, {"reflectance": reflectance})


POLISHED = Material("conductor", {"material": "none"}, {"specular_reflectance": (0.91, 0.92, 0.92)})
COPPER = Material("roughconductor", {"material": "Cu", "distribution": "ggx", "alpha": 0.2}, {})


def band(profile: Sequence[tuple[float, float]]) -> trimesh.Trimesh:
    """An open surface of revolution about Z; its front is on the right of the profile [K, 2]."""
    points = np.asarray(profile, np.float64)
    angle = np.linspace(0, 2 * np.pi, SECTIONS, endpoint=False)
    rings = np.stack(
        (points[:, :1] * np.cos(angle), points[:, :1] * np.sin(angle),
         np.repeat(points[:, 1:], SECTIONS, 1)), -1
    )  # fmt: skip
    k, i = np.meshgrid(np.arange(len(points) - 1), np.arange(SECTIONS), indexing="ij")
    j = (i + 1) % SECTIONS
    a, b, c, d = k * SECTIONS + i, k * SECTIONS + j, (k + 1) * SECTIONS + j, (k + 1) * SECTIONS + i
    faces = np.concatenate((np.stack((a, b, c), -1), np.stack((a, c, d), -1))).reshape(-1, 3)
    return trimesh.Trimesh(rings.reshape(-1, 3), faces, process=False)


def desk_lamp() -> list[Part]:
    """A black shade, white inside, over an opal bulb, on an arm and a base."""
    wall = 0.0015
    outer = [(0.09, 0.30), (0.075, 0.36), (0.03, 0.40), (0.0, 0.405)]
    inner = [(r - wall if r > wall else 0.0, z - wall) for r, z in outer]
    bulb = trimesh.creation.icosphere(subdivisions=3, radius=0.025)
    bulb.apply_translation((0.0, 0.0, 0.345))
    radiance: RGB = tuple(BULB_RADIANCE * w for w in WARM_WHITE)  # type: ignore[assignment]
    arm = tube([[0.0, 0.0, 0.403], [0.12, 0.0, 0.40], [0.14, 0.0, 0.02]], 0.006, sides=12)
    base = trimesh.creation.cylinder(0.07, 0.02, sections=SECTIONS)
    base.apply_translation((0.14, 0.0, 0.01))
    black, white = (0.04, 0.045, 0.05), (0.8, 0.8, 0.78)
    return [
        Part("bulb", bulb, two_sided(white), radiance),
        Part("shade", band(outer), two_sided(black)),
        Part("reflector", band(inner[::-1]), two_sided(white)),
        Part("rim", band([inner[0], outer[0]]), two_sided(black)),
        Part("arm", arm, COPPER),
        Part("base", base, two_sided((0.08, 0.2, 0.35))),
    ]


def metal_lamp() -> list[Part]:
    """A bulb in a polished bowl, on a stand of rough copper."""
    turn = np.radians(np.linspace(0, 75, 24))
    outer = [(0.08 * np.sin(t), 0.14 - 0.08 * np.cos(t)) for t in turn]
    inner = [(0.0785 * np.sin(t), 0.14 - 0.0785 * np.cos(t)) for t in turn]
    bulb = trimesh.creation.icosphere(subdivisions=3, radius=0.02)
    bulb.apply_translation((0.0, 0.0, 0.12))
    radiance: RGB = tuple(BULB_RADIANCE * w for w in WARM_WHITE)  # type: ignore[assignment]
    stand = trimesh.creation.cylinder(0.05, 0.055, sections=SECTIONS)
    stand.apply_translation((0.0, 0.0, 0.0285))
    return [
        Part("bulb", bulb, two_sided((0.8, 0.8, 0.78)), radiance),
        Part("bowl", band(outer), POLISHED),
        Part("reflector", band(inner[::-1]), POLISHED),
        Part("rim", band([outer[-1], inner[-1]]), POLISHED),
        Part("stand", stand, COPPER),
    ]


LAMPS: dict[str, Callable[[], list[Part]]] = {
    "shade": desk_lamp,
    "metal": metal_lamp,
    "clear_globe": filament_bulb.parts,
    "frosted_globe": frosted_globe.parts,
    "crystal": crystal.parts,
}


def write(folder: Path, name: str, *, on: bool = True) -> Path:
    """The scene of a lamp and its meshes, with its emitters or without; the XML's path."""
    parts = LAMPS[name]()
    if not on:
        parts = [replace(part, radiance=None) for part in parts]
    return write_scene(folder, name if on else f"{name}_off", parts)
