"""Lamps of many parts around a middle: petals, chandeliers, globes on chains, spirals."""

from __future__ import annotations

import numpy as np

from benchmarks.zoo.lamps import bulbs, finishes, sources
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.pieces import Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift, turn
from benchmarks.zoo.lamps.sources import Space
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import helix, revolve, tube
from purelight_examples.luminaires.solids import Floats


def petals(draw: Draw) -> list[Part]:
    """Layers of curved leaves of glass or cloth around a bulb."""
    layers = draw.whole(1, 3)
    parts: list[Part] = []
    low, high = draw.number(0.5, 0.7), draw.number(1.7, 2.3)
    flare = draw.number(-0.3, 0.5)
    for layer in range(layers):
        scale = 0.72**layer
        count = draw.whole(4, 9)
        sheet = draw.chance(0.4)
        finish = finishes.thin_glass(draw) if sheet else finishes.glass(draw, 0.03).outside
        if sheet and draw.chance(0.5):
            finish = finishes.cloth(draw)
        patch = scale * _petal(np.pi / count * 0.9, low, high, flare)
        for k in range(count):
            about = turn("z", 2 * np.pi * (k + 0.5 * layer) / count)
            body = Mesh(*solids.patch(patch)) if sheet else Mesh(solids.slab(patch, 0.03 * scale))
            piece = Piece(f"petal_{layer}_{k}", body, finish, solid=not sheet)
            parts.append(piece.moved(about))
    clear = 0.72 ** (layers - 1) * 0.5
    return [*sources.source(draw, Space(0.7 * clear, 0.7 * clear)), *parts]


def chandelier(draw: Draw) -> list[Part]:
    """A turned column with bent arms that carry bulbs, in one or two tiers."""
    t = np.linspace(0, 1, 41)
    swell = 0.06 + 0.03 * np.sin(draw.whole(2, 5) * np.pi * t) ** 2
    column = np.concatenate(([[0, -0.5]], np.stack((swell, -0.5 + t), 1), [[0, 0.5]]))
    metal = finishes.metal(draw)
    parts: list[Part] = [Piece("column", Mesh(revolve(column, 32)), metal)]
    for tier in range(draw.pick((1, 1, 2))):
        count = draw.whole(3, 12)
        reach, level = 0.8 - 0.3 * tier, -0.2 + 0.5 * tier
        size = min(0.1, 0.32 * reach * np.sin(np.pi / count))
        thick = min(0.018, 0.25 * size)
        up = draw.chance(0.6)
        side = 1 if up else -1  # bulbs stand on arms that rise, or hang from arms that fall
        arm = Mesh(tube(_arm(reach, side, level), thick, 10))
        end = level + side * (0.1 + bulbs.BULB_TOP * size + 2 * thick)
        for k in range(count):
            about = turn("z", 2 * np.pi * (k + 0.5 * tier) / count)
            name = f"{tier}_{k}_"
            bulb = bulbs.hung(draw, size, (reach, 0, end), name, up=up)
            parts += moved([Piece(f"arm_{name}", arm, metal), *bulb], about)
    return parts


def chain(draw: Draw) -> list[Part]:
    """Globes at several heights on chains from a plate."""
    plate = revolve([[0, 0.9], [0.7, 0.9], [0.7, 0.97], [0, 0.97]], 56)
    parts: list[Part] = [Piece("plate", Mesh(plate), finishes.opaque(draw))]
    count = draw.whole(1, 6)
    around = 0.0 if count == 1 else 0.45
    size = 0.3 if count == 1 else min(0.25, 0.8 * around * np.sin(np.pi / count))
    link = solids.ring(_link(0.05, 0.024), 0.006, 8)
    steel = finishes.metal(draw)
    for k, at in enumerate(solids.circle(around, count)):
        links = draw.whole(3, 10)
        drop = 0.86 - 0.05
        for i in range(links):
            about = shift(at[0], at[1], drop) @ turn("z", 0.5 * np.pi * (i % 2))
            parts.append(Piece(f"link_{k}_{i}", Mesh(link), steel).moved(about))
            drop -= 2 * 0.05 - 2 * 0.006 - 0.008
        centre = (at[0], at[1], drop - 0.01 - bulbs.BULB_TOP * size)
        parts += bulbs.hung(draw, size, centre, f"globe_{k}_", simple=count > 1)
    return parts


def spiral(draw: Draw) -> list[Part]:
    """A glowing coil, or a coil of glass around a column of light."""
    turns, radius = draw.whole(3, 7), draw.number(0.35, 0.6)
    path = helix(turns, radius, 1.6, 28)
    thick = 0.3 * 1.6 / turns * draw.number(0.4, 0.8)
    if draw.chance(0.5):
        coil = Piece("coil", Mesh(tube(path, thick, 14)), sources.lamp_black(draw),
                     sources.colour(draw, 0.5))  # fmt: skip
        parts: list[Part] = [coil]
    else:
        glass = finishes.glass(draw, thick).outside
        parts = [Piece("coil", Mesh(tube(path, thick, 16)), glass)]
        core = sources.source(draw, Space(0.6 * (radius - thick), 0.8))
        parts += moved(core, turn("y", np.pi / 2))
    return moved(parts, turn("y", np.pi / 2))


def _petal(half_angle: float, low: float, high: float, flare: float) -> Floats:
    """A leaf about the origin: polar angle from the nadir low to high, [U, V, 3].

    Seen from the origin every direction meets it once, so leaves of other sizes do not touch it.
    """
    u, v = np.linspace(-1, 1, 13), np.linspace(0, 1, 25)
    polar = low + (high - low) * v
    reach = 0.85 * (1 + flare * (v - 0.5))
    width = half_angle * np.sin(np.pi * (0.12 + 0.8 * v)) ** 0.7
    angle = u[:, None] * width[None]
    r, z = reach * np.sin(polar), -reach * np.cos(polar)
    return np.stack((r * np.cos(angle), r * np.sin(angle), np.broadcast_to(z, angle.shape)), -1)


def _arm(reach: float, side: int, level: float) -> Floats:
    """A bent arm in the plane y = 0 from the column out to a bulb, a tenth higher or lower."""
    t = np.linspace(0, 1, 25)
    x = 0.13 + (reach - 0.13) * t
    z = level + side * (0.1 * t**2 - 0.15 * np.sin(np.pi * t) * (1 - t))
    return np.stack((x, np.zeros(25), z), 1)


def _link(half: float, across: float) -> Floats:
    """Middle line of a chain's link in the plane y = 0: a stadium, `half` its half-height."""
    t = np.linspace(0, np.pi, 9)
    top = np.stack((across * np.cos(t), np.zeros(9), half - across + across * np.sin(t)), 1)
    return np.concatenate((top, -top))
