"""A desk lamp with springs, screws and a fine shade, as lamps from product models are.

    python -m benchmarks.detailed_lamp --output out/desk

writes its scene, for `purelight-train`. Three quarters of its triangles are threads and wire.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import (
    BRASS,
    FROSTED_GLASS,
    NICKEL,
    WARM_WHITE,
    Material,
    Part,
    write_scene,
)
from purelight_examples.luminaires.parts import helix, revolve, tube
from purelight_format import command

PAINT = Material("roughplastic", {"alpha": 0.2}, {"diffuse_reflectance": (0.12, 0.3, 0.33)})
WHITE = Material("diffuse", {}, {"reflectance": (0.85, 0.85, 0.82)})
RED, GREEN, BLUE = WARM_WHITE
RADIANCE = (120.0 * RED, 120.0 * GREEN, 120.0 * BLUE)
JOINTS = np.array([[-0.16, 0.0, -0.28], [-0.2, 0.0, -0.02], [-0.04, 0.0, 0.12]])


def parts() -> list[Part]:
    """The lamp's parts; the shade hangs about the origin, open below."""
    return [*_head(), *_arm(), *_hardware()]


def _head() -> list[Part]:
    angle = np.linspace(np.radians(6), np.radians(80), 90)
    outside = 0.09 * np.stack([np.sin(angle), np.cos(angle)], 1)
    inside = outside[::-1] * 0.975
    shade = revolve(np.concatenate([[[0, 0.0899]], outside, inside, [[0, 0.0875]]]), 192)
    bulb = revolve(_ball(0.03), 96).apply_translation([0, 0, 0.035])
    led = trimesh.creation.icosphere(subdivisions=3, radius=0.012)
    return [
        Part("shade", shade, PAINT),
        Part("bulb", bulb, FROSTED_GLASS),
        Part("led", led.apply_translation([0, 0, 0.035]), WHITE, RADIANCE),
    ]


def _ball(radius: float) -> np.ndarray:
    polar = np.linspace(0, np.pi, 65)
    profile = radius * np.stack([np.sin(polar), -np.cos(polar)], 1)
    profile[[0, -1], 0] = 0
    return profile


def _arm() -> list[Part]:
    rods = [tube(_line(a, b), 0.006, 48) for a, b in itertools.pairwise(JOINTS)]
    rods.append(tube(_line(JOINTS[2], np.array([0.0, 0.0, 0.1])), 0.006, 48))
    base = revolve([[0, -0.3], [0.09, -0.3], [0.092, -0.297], [0.09, -0.29], [0.02, -0.28],
                    [0, -0.28]], 192).apply_translation([-0.16, 0, 0])  # fmt: skip
    return [Part("rods", trimesh.util.concatenate(rods), NICKEL), Part("base", base, PAINT)]


def _line(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    return start + np.linspace(0, 1, 24)[:, None] * (end - start)


def _hardware() -> list[Part]:
    """Four springs along the arm, and three screws at each joint and around the base."""
    springs, screws = [], []
    for a, b in itertools.pairwise(JOINTS):
        for side in (-0.016, 0.016):
            coil = tube(helix(36, 0.005, 0.8 * float(np.linalg.norm(b - a)), 28), 0.0009, 10)
            springs.append(_along(coil, a, b, [0, side, 0]))
    for joint in JOINTS:
        screws += [_screw().apply_translation(joint + np.array([0, y, 0])) for y in (-0.012, 0.012)]
    for k in range(8):
        turn = 2 * np.pi * k / 8
        place = [-0.16 + 0.075 * np.cos(turn), 0.075 * np.sin(turn), -0.284]
        screws.append(_screw().apply_translation(place))
    return [
        Part("springs", trimesh.util.concatenate(springs), NICKEL),
        Part("screws", trimesh.util.concatenate(screws), BRASS),
    ]


def _along(
    mesh: trimesh.Trimesh, a: np.ndarray, b: np.ndarray, aside: Sequence[float]
) -> trimesh.Trimesh:
    """A mesh about the X axis, moved to lie from a to b, and aside."""
    turn = trimesh.geometry.align_vectors([1, 0, 0], (b - a) / np.linalg.norm(b - a))
    return mesh.apply_transform(turn).apply_translation((a + b) / 2 + aside)


def _screw() -> trimesh.Trimesh:
    """A threaded bolt with a round head."""
    head = [[0, 0.005], [0.002, 0.0049], [0.0035, 0.0042], [0.0042, 0.003], [0.0042, 0.002]]
    z = np.linspace(0.002, -0.008, 40)
    thread = np.stack([0.0022 + 0.0003 * np.sin(np.arange(40) * np.pi / 2), z], 1)
    return revolve(np.concatenate([head, thread, [[0, -0.008]]])[::-1], 40)


def write(folder: Path) -> Path:
    """Writes `desk_lamp.xml` and its meshes; returns the XML's path."""
    return write_scene(folder, "desk_lamp", parts())


def main() -> int:
    """Writes the lamp, and says where."""
    parser = command.Parser(prog="python -m benchmarks.detailed_lamp", description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="a folder")
    print(write(parser.parse_args().output))
    return 0


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.detailed_lamp", main))
