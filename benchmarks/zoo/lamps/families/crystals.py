"""Solid glass with flat facets, and solid glass lit through its face."""

from __future__ import annotations

import numpy as np
import trimesh

from benchmarks.zoo.lamps import bulbs, finishes, sources
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.pieces import Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift, turn
from benchmarks.zoo.lamps.sources import Space
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import revolve


def crystal(draw: Draw) -> list[Part]:
    """Cut glass with a round or cut hollow, one or two in each other."""
    parts: list[Part] = []
    scale = 1.0
    for layer in range(draw.whole(1, 2)):
        outer = _cut(draw, scale)
        clear = solids.clear_radius(outer)
        hollow_radius = draw.number(0.6, 0.8) * clear
        hollow = _ball(hollow_radius) if draw.chance(0.6) else _cut_hollow(draw, hollow_radius)
        body = solids.joined([outer, solids.inverted(hollow)])
        glass = finishes.glass(draw, clear - hollow_radius).outside
        parts.append(Piece(f"crystal_{layer}", Mesh(body), glass))
        free = min(hollow_radius, solids.clear_radius(hollow))
        scale = 0.9 * free
    return [*sources.source(draw, Space(0.65 * free, 0.65 * free)), *parts]


def drops(draw: Draw) -> list[Part]:
    """Rings of solid cut drops around a bulb, below a metal hoop."""
    parts = bulbs.hung(draw, 0.22, (0, 0, 0.1), "bulb_", simple=False)
    for ring in range(draw.whole(1, 3)):
        count = draw.whole(8, 16)
        around = 0.5 + 0.22 * ring
        size = min(0.4 * 2 * around * np.sin(np.pi / count), 0.09)
        tall = draw.number(1.5, 3)
        glass = finishes.glass(draw, size).outside
        drop = _drop(draw, size, tall)
        for k, at in enumerate(solids.circle(around, count, 0.35 - 0.25 * ring)):
            about = shift(*at) @ turn("z", 2 * np.pi * k / count)
            parts.append(Piece(f"drop_{ring}_{k}", Mesh(drop), glass).moved(about))
        hoop = solids.ring(solids.circle(around, 64, 0.5 - 0.25 * ring + tall * size), 0.015, 10)
        parts.append(Piece(f"hoop_{ring}", Mesh(hoop), finishes.metal(draw)))
    return parts


def ice(draw: Draw) -> list[Part]:
    """A solid block or ball of glass, with bubbles or without, on a board of LEDs."""
    sides = draw.pick((4, 6, 8, 48))
    if draw.chance(0.4):
        body, clear = _ball(0.7), 0.6
    else:
        body = _cut(draw, 0.8, sides)
        clear = 0.9 * solids.clear_radius(body)
    made = [body]
    for at in _bubbles(draw, clear):
        made.append(solids.inverted(_ball(0.06 * clear, 9, 16).apply_translation(at)))
    glass = finishes.glass(draw, 0.8).outside
    block = Piece("block", Mesh(solids.joined(made), smooth=False), glass)
    low = float(body.vertices[:, 2].min())
    return [block, *moved(lit_disc(draw, 0.6), shift(z=low - 0.05))]


def lens(draw: Draw) -> list[Part]:
    """A ball lens over a small source on a stand, with a black tube or without."""
    parts: list[Part] = [
        Piece("lens", Mesh(_ball(0.4)), finishes.glass(draw, 0.5).outside),
        *moved(sources.source(draw, Space(0.2, 0.15)), shift(z=-draw.number(0.58, 0.9))),
        Piece("stand", Mesh(revolve([[0, -1.2], [0.5, -1.2], [0.5, -1.1], [0, -1.1]], 48)),
              finishes.opaque(draw)),
    ]  # fmt: skip
    if draw.chance(0.5):
        loop = solids.band([[0.5, -1.07], [0.5, -0.5], [0.5, draw.number(-0.3, 0.6)]], 0.04)
        parts.append(Piece("tube", Mesh(solids.lathe(loop, 48)), finishes.opaque(draw)))
    return parts


def lit_disc(draw: Draw, radius: float) -> list[Part]:
    """A round board about Z with LEDs that shine up, its upper face at zero."""
    board = revolve([[0, -0.06], [radius, -0.06], [radius, -0.005], [0, -0.005]], 48)
    parts: list[Part] = [Piece("board", Mesh(board), finishes.opaque(draw))]
    for ring in range(draw.whole(1, 3)):
        around = radius * (0.25 + 0.25 * ring)
        for at in solids.circle(around, draw.whole(3, 8)):
            led = sources.led(draw, 0.05 * radius)
            parts += moved([led], shift(*at), f"led_{len(parts)}_")
    return parts


def _cut(draw: Draw, scale: float, sides: int = 0) -> trimesh.Trimesh:
    """A cut stone of radius `scale`: rings of corners, every other one turned by half a side."""
    rings = draw.whole(4, 7)
    polar = np.linspace(0.35, np.pi - 0.35, rings)
    tall = draw.number(0.7, 1.2)
    corners = [
        (np.sin(a) * draw.number(0.92, 1.0), 0.5 * (k % 2), -tall * np.cos(a))
        for k, a in enumerate(polar)
    ]
    stone = solids.gem(corners, sides or draw.whole(5, 12))
    return stone.apply_scale(scale / np.linalg.norm(stone.vertices, axis=1).max())


def _cut_hollow(draw: Draw, radius: float) -> trimesh.Trimesh:
    polar = np.linspace(0.4, np.pi - 0.4, 4)
    rings = [(radius * np.sin(a), 0.5 * (k % 2), -radius * np.cos(a)) for k, a in enumerate(polar)]
    return solids.gem(rings, draw.whole(6, 10))


def _drop(draw: Draw, size: float, tall: float) -> trimesh.Trimesh:
    """A pendant: pointed above, round below."""
    rings = [(0.25, 0, -1.0), (0.8, 0.5, -0.6), (1.0, 0, -0.2), (0.6, 0.5, 0.4), (0.1, 0, 1.0)]
    return solids.gem([(size * r, t, tall * size * z) for r, t, z in rings], draw.whole(5, 8))


def _bubbles(draw: Draw, clear: float) -> list[np.ndarray]:
    """Places of up to a dozen hollows that do not meet."""
    places: list[np.ndarray] = []
    for _ in range(draw.pick((0, 6, 16))):
        at = np.array([draw.number(-0.5, 0.5) * clear for _ in range(3)])
        if all(np.linalg.norm(at - other) > 0.14 * clear for other in places):
            places.append(at)
    return places


def _ball(radius: float, steps: int = 33, sections: int = 64) -> trimesh.Trimesh:
    polar = np.linspace(0, np.pi, steps)
    profile = radius * np.stack((np.sin(polar), -np.cos(polar)), 1)
    profile[[0, -1], 0] = 0
    return revolve(profile, sections)
