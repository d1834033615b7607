"""Flat lamps: boards of LEDs, screens, louvres, neon."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh

from benchmarks.zoo.lamps import finishes, sources, textures
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh, Primitive
from benchmarks.zoo.lamps.pieces import Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift, turn
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import revolve, tube
from purelight_examples.luminaires.solids import Floats


def led_board(draw: Draw) -> list[Part]:
    """A board of up to sixty LEDs, bare, under domes, or behind a plate; it shines down."""
    columns, rows = draw.whole(2, 10), draw.whole(1, 6)
    pitch = 1.6 / max(columns, rows)
    half = (0.5 * pitch * columns + 0.05, 0.5 * pitch * rows + 0.05)
    parts: list[Part] = [_box("board", (*half, 0.03), finishes.opaque(draw), z=-0.035)]
    cover = draw.pick(("none", "none", "domes", "plate", "thin"))
    dome = _hemisphere(0.42 * pitch)
    glass = finishes.glass(draw, 0.3 * pitch).outside
    for i in range(columns):
        for j in range(rows):
            at = ((i - (columns - 1) / 2) * pitch, (j - (rows - 1) / 2) * pitch)
            parts += moved([sources.led(draw, 0.16 * pitch)], shift(*at), f"{i}_{j}_")
            if cover == "domes":
                lens = Piece(f"dome_{i}_{j}", Mesh(dome), glass)
                parts.append(lens.moved(shift(*at, 0.06 * pitch)))
    if cover == "plate":
        parts.append(_box("cover", (*half, 0.03), glass, z=0.15 + 0.5 * pitch))
    if cover == "thin":
        matrix = np.diag([*half, 1.0, 1.0])
        matrix[2, 3] = 0.15 + 0.5 * pitch
        skin = finishes.thin_glass(draw) if draw.chance(0.5) else finishes.cloth(draw)
        parts.append(Piece("cover", Primitive("rectangle", matrix), skin, solid=False))
    if draw.chance(0.4):
        parts += _fins(draw, half)
    return moved(parts, turn("x", np.pi))


def screen(draw: Draw) -> list[Part]:
    """A board that shows a picture, behind bars or glass."""
    half = (0.8, draw.number(0.4, 0.8))
    picture, files = textures.bitmap(textures.screen(draw))
    matrix = np.diag([*half, 1.0, 1.0])
    black = sources.lamp_black(draw)
    face = Primitive("rectangle", matrix)
    frame = (half[0] + 0.05, half[1] + 0.05, 0.04)
    parts: list[Part] = [
        Piece("screen", face, replace(black, textures=files), picture, solid=False),
        _box("back", frame, finishes.opaque(draw), z=-0.06),
    ]
    if draw.chance(0.5):
        thick = draw.number(0.02, 0.1)
        parts.append(_box("glass", (*half, thick), finishes.glass(draw, thick).outside, z=0.3))
    else:
        bars = finishes.opaque(draw)
        for k, x in enumerate(np.linspace(-0.7, 0.7, draw.whole(3, 8))):
            bar = _box(f"bar_{k}", (0.02, half[1], 0.08), bars, z=0.2)
            parts += moved([bar], shift(x))
    return moved(parts, turn("y", np.pi / 2))


def louvre(draw: Draw) -> list[Part]:
    """A trough, open below, with fluorescent tubes and fins across."""
    half = (0.9, draw.number(0.3, 0.6), 0.2)
    housing = Piece("housing", Mesh(solids.tray(half, 0.03)), finishes.opaque(draw))
    parts: list[Part] = [housing]
    count = draw.whole(1, 4)
    pitch = 2 * (half[1] - 0.05) / count
    radius = min(0.06, 0.3 * pitch)
    for k in range(count):
        y = (k - (count - 1) / 2) * pitch
        body = tube([[-0.8, y, 0.06], [0, y, 0.06], [0.8, y, 0.06]], radius, 16)
        parts.append(Piece(f"tube_{k}", Mesh(body), sources.lamp_black(draw), sources.colour(draw)))
    if draw.chance(0.6):
        fin = finishes.opaque(draw)
        for k, x in enumerate(np.linspace(-0.75, 0.75, draw.whole(3, 9))):
            blade = _box(f"fin_{k}", (0.006, half[1] - 0.05, 0.05), fin, z=-0.12)
            parts += moved([blade], shift(x))
    else:
        cover = finishes.glass(draw, 0.04).outside
        parts.append(_box("cover", (half[0] - 0.05, half[1] - 0.05, 0.02), cover, z=-0.15))
    return parts


def neon(draw: Draw) -> list[Part]:
    """Bent tubes of several colours before a board, bare or in pipes of glass."""
    parts: list[Part] = [_box("board", (0.95, 0.95, 0.03), finishes.paint(draw), z=-0.2)]
    piped = draw.chance(0.5)
    for k in range(draw.whole(1, 5)):
        thick = draw.number(0.015, 0.03)
        path = _loop(draw, 0.85 - 0.16 * k)
        shine = sources.colour(draw, 0.8)
        glow = solids.ring(path, thick, 10)
        parts.append(Piece(f"glow_{k}", Mesh(glow), sources.lamp_black(draw), shine))
        if piped:
            glass = finishes.glass(draw, 0.5 * thick)
            hollow = solids.inverted(solids.ring(path, 1.3 * thick, 14))
            parts += [
                Piece(f"pipe_{k}", Mesh(solids.ring(path, 1.8 * thick, 14)), glass.outside),
                Piece(f"pipe_{k}_hollow", Mesh(hollow), glass.inside),
            ]
    return moved(parts, turn("y", np.pi / 2))


def _loop(draw: Draw, size: float) -> Floats:
    """A wavy closed line about Z, at most `size` from the axis, and not less than by a tenth."""
    t = np.linspace(0, 2 * np.pi, 120, endpoint=False)
    radius = size * (0.98 + 0.02 * np.cos(draw.whole(2, 6) * t))
    return np.stack((radius * np.cos(t), radius * np.sin(t), np.zeros(120)), 1)


def _hemisphere(radius: float) -> trimesh.Trimesh:
    t = np.linspace(0, np.pi / 2, 9)
    profile = radius * np.stack((np.cos(t), np.sin(t)), 1)
    profile[-1, 0] = 0
    return revolve(np.concatenate(([[0, 0]], profile)), 24)


def _fins(draw: Draw, half: tuple[float, float]) -> list[Part]:
    metal = finishes.metal(draw)
    parts: list[Part] = []
    for k, x in enumerate(np.linspace(-0.9, 0.9, 7) * half[0]):
        fin = _box(f"fin_{k}", (0.01, half[1], 0.12), metal, z=-0.2)
        parts += moved([fin], shift(x))
    return parts


def _box(name: str, half: tuple[float, float, float], finish: finishes.Finish, z: float) -> Piece:
    x, y, high = half
    outline = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    return Piece(name, Mesh(solids.prism(outline, z - high, z + high)), finish)
