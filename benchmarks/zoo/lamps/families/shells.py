"""Glass around light: globes, tubes, lanterns without lids, rings, stacks of beads."""

from __future__ import annotations

import numpy as np

from benchmarks.zoo.lamps import bulbs, finishes, sources
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.pieces import Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift, turn
from benchmarks.zoo.lamps.sources import Space
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import inset, revolve, tube


def globe(draw: Draw) -> list[Part]:
    """One to three globes in each other, hung from a cap by their necks, or floating."""
    if draw.chance(0.4):
        return bulbs.bulb(draw, diffused=True)
    shells = draw.pick((1, 2, 2, 3))
    return bulbs.nested(draw, bulbs.vessel(draw, 0.12), shells)


def vessel(draw: Draw) -> list[Part]:
    """A bottle with waists and bellies, so strong that it sees itself."""
    return bulbs.nested(draw, bulbs.vessel(draw, 0.5), draw.whole(1, 2))


def closed_tube(draw: Draw) -> list[Part]:
    """A round-ended tube with a long source, in one or two layers, between metal caps."""
    radius = draw.number(0.1, 0.3)
    outline = bulbs.capsule(radius, 1.0)
    wall = draw.number(0.06, 0.12) * radius
    parts = bulbs.walled("tube", outline, wall, finishes.glass(draw, wall), 40)
    free = 0.8 * (radius - wall)
    if draw.chance(0.5):
        inner = bulbs.capsule(0.7 * (radius - wall), 0.93)
        thin = 0.08 * radius
        parts += bulbs.walled("inner", inner, thin, finishes.glass(draw, thin), 32)
        free = 0.8 * (0.7 * (radius - wall) - thin)
    parts += sources.source(draw, Space(free, 0.75))
    holder = finishes.opaque(draw)
    for side in (-1, 1):
        loop = [[1.06, 0.8], [1.3, 0.8], [1.3, 1.15], [1.06, 1.15]]
        ends = np.array(loop) * (radius, side)
        parts.append(Piece(f"holder_{side + 1}", Mesh(solids.lathe(ends, 40)), holder))
    return moved(parts, turn("y", np.pi / 2)) if draw.chance(0.6) else parts


def open_tube(draw: Draw) -> list[Part]:
    """A chimney of glass, open above and below, around a candle or bulb on a foot."""
    t = np.linspace(0, 1, 33)
    radius = draw.number(0.35, 0.55) * (1 + draw.number(-0.3, 0.4) * np.sin(np.pi * t) ** 2)
    profile = np.stack((radius, -0.75 + 1.7 * t), 1)
    least = float(radius.min())
    if draw.chance(0.3):
        sheet, uv = solids.sheet(profile, 64)
        glass: list[Part] = [
            Piece("chimney", Mesh(sheet, uv), finishes.thin_glass(draw), solid=False)
        ]
    else:
        wall = draw.number(0.02, 0.06)
        made = finishes.glass(draw, wall).outside
        glass = [Piece("chimney", Mesh(solids.lathe(solids.band(profile, wall), 56)), made)]
    foot = [[0, -0.95], [0.6, -0.95], [0.6, -0.9], [0.5, -0.8], [0, -0.8]]
    parts = [*glass, Piece("foot", Mesh(revolve(foot, 48)), finishes.opaque(draw))]
    if draw.chance(0.5):
        size = 0.55 * least
        return [*parts, *bulbs.hung(draw, size, (0, 0, 0.1), "bulb_", simple=False, up=True)]
    candle = revolve([[0, -0.78], [0.4 * least, -0.78], [0.4 * least, -0.3], [0, -0.3]], 32)
    wax = Piece("candle", Mesh(candle), finishes.white(draw))
    return [*parts, wax, *moved(sources.source(draw, Space(0.5 * least, 0.25)), shift(z=0))]


def ring(draw: Draw) -> list[Part]:
    """Rings of glass with light along their middle, one in another, tilted."""
    parts: list[Part] = []
    outer = 0.9
    for count in range(draw.whole(1, 3)):
        thick = draw.number(0.06, 0.1) * (outer / 0.9)
        wall = draw.number(0.12, 0.25) * thick
        around = solids.circle(outer, 80)
        glass = finishes.glass(draw, wall)
        hollow = solids.inverted(solids.ring(around, thick - wall, 20))
        body = [
            Piece("glass", Mesh(solids.ring(around, thick, 20)), glass.outside),
            Piece("hollow", Mesh(hollow), glass.inside),
            *_along(draw, outer, 0.45 * (thick - wall)),
        ]
        tilt = turn("x", draw.number(-0.12, 0.12) if count else 0.0)
        parts += moved(body, tilt, f"ring{count}_")
        outer *= draw.number(0.55, 0.7)
    return parts


def _along(draw: Draw, radius: float, thick: float) -> list[Part]:
    """A glowing ring, or up to thirty short pieces of one."""
    if draw.chance(0.5):
        mesh = solids.ring(solids.circle(radius, 80), thick, 10)
        return [Piece("glow", Mesh(mesh), sources.lamp_black(draw), sources.colour(draw))]
    count = draw.whole(6, 30)
    lit: list[Part] = []
    for k in range(count):
        angle = 2 * np.pi * (k + np.linspace(0.2, 0.8, 5)) / count
        path = radius * np.stack((np.cos(angle), np.sin(angle), np.zeros(5)), 1)
        body = Mesh(tube(path, thick, 8))
        lit.append(Piece(f"glow_{k}", body, sources.lamp_black(draw), sources.colour(draw)))
    return lit


def stack(draw: Draw) -> list[Part]:
    """Beads of solid glass threaded on a column of light, with waists between them."""
    core = draw.number(0.12, 0.2)
    parts = sources.source(draw, Space(core, 0.95))
    count = draw.whole(3, 8)
    half = 0.95 / count
    for k in range(count):
        across = draw.number(0.3, 0.6)
        t = np.linspace(-1, 1, 13)
        bulge = np.sqrt(np.maximum(1 - t**2, 0)) if draw.chance(0.5) else 1 - np.abs(t) * 0.6
        outer = np.stack((core + 0.08 + (across - core) * bulge, 0.9 * half * t), 1)
        inner = np.stack((np.full(13, core + 0.03), 0.9 * half * t), 1)[::-1]
        sides = draw.pick((6, 8, 12, 48))
        mesh = solids.lathe(np.concatenate((outer, inner)), sides)
        made = finishes.glass(draw, across).outside
        bead = Piece(f"bead_{k}", Mesh(mesh), made)
        parts.append(bead.moved(shift(z=(2 * k + 1 - count) * half)))
    return parts


def thick_globe(draw: Draw) -> list[Part]:
    """A globe with a wall a third of its radius."""
    outline = bulbs.vessel(draw, 0.1)
    wall = draw.number(0.25, 0.4)
    hollow = inset(outline, wall)
    clear = 0.6 * float(np.linalg.norm(hollow, axis=1).min())
    glass = finishes.glass(draw, wall)
    shine = sources.source(draw, Space(clear, clear), diffused=glass.diffuses)
    return [*shine, *bulbs.walled("globe", outline, wall, glass, 64)]
