"""Light under or in a shade: metal, cloth, paper, pierced sheets, mirrors."""

from __future__ import annotations

import numpy as np
import trimesh

from benchmarks.zoo.lamps import bulbs, finishes, sources
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh, Primitive
from benchmarks.zoo.lamps.pieces import Finish, Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift, turn
from benchmarks.zoo.lamps.sources import Space
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import revolve, tube
from purelight_examples.luminaires.solids import Floats


def metal_shade(draw: Draw) -> list[Part]:
    """A bell, cone or bowl over a bulb, open below."""
    profile = _bell(draw)
    shade = Piece("shade", Mesh(solids.dome(profile, 0.03, 64)), finishes.opaque(draw))
    rod = [[0, 0, 0.55], [0, 0, 0.7], [0, 0, 0.95]]
    stem = Piece("stem", Mesh(tube(rod, 0.05, 16)), finishes.metal(draw))
    size = draw.number(0.12, 0.2)
    at = (0.0, 0.0, 0.48 - bulbs.BULB_TOP * size - 0.05)
    return [shade, *bulbs.hung(draw, size, at, "bulb_", simple=False), stem]


def cloth_shade(draw: Draw) -> list[Part]:
    """A drum or cone of cloth, smooth or pleated, around a bulb on a foot."""
    low, high = draw.number(0.55, 0.85), draw.number(0.25, 0.6)
    profile = np.stack((np.linspace(low, high, 9), np.linspace(-0.3, 0.6, 9)), 1)
    pleats = draw.pick((0, 0, 24, 40))
    sheet, uv = solids.sheet(profile, 8 * pleats if pleats else 72, pleats, 0.03)
    shade = Piece("shade", Mesh(sheet, uv), finishes.cloth(draw), solid=False)
    return [shade, *bulbs.hung(draw, 0.13, (0, 0, 0.15), "bulb_", simple=False, up=True),
            *_foot(draw, -0.15)]  # fmt: skip


def paper(draw: Draw) -> list[Part]:
    """A paper lantern with ribs, open at its poles, around points of light or a bulb."""
    t = np.linspace(0.25, np.pi - 0.25, 65)
    ribs = 1 + 0.02 * np.cos(draw.whole(8, 16) * 2 * t)
    tall = draw.number(0.7, 1.4)
    profile = 0.8 * np.stack((ribs * np.sin(t), -tall * np.cos(t)), 1)
    sheet, uv = solids.sheet(profile, 64)
    lantern = Piece("paper", Mesh(sheet, uv), finishes.cloth(draw), solid=False)
    return [lantern, *sources.source(draw, Space(0.35, 0.35), diffused=True)]


def lantern(draw: Draw) -> list[Part]:
    """A pierced drum or ball between two plates, around a bulb."""
    t = np.linspace(-1, 1, 33)
    bulge = draw.number(0, 0.4)
    profile = np.stack((0.5 + bulge * (1 - t**2), 0.7 * t), 1)
    sheet, uv = solids.sheet(profile, 72)
    wall = Piece("wall", Mesh(sheet, uv), finishes.pierced(draw), solid=False)
    parts: list[Part] = [wall]
    plate = finishes.opaque(draw)
    for side in (-1, 1):
        outline = np.array([[0, 0.73], [0.56, 0.73], [0.56, 0.8], [0, 0.8]]) * (1, side)
        parts.append(Piece(f"plate_{side + 1}", Mesh(revolve(outline, 56)), plate))
    return [*parts, *bulbs.hung(draw, 0.2, (0, 0, 0.05), "bulb_", simple=False)]


def desk(draw: Draw) -> list[Part]:
    """A foot, an arm with a joint, and a tilted metal head with a bulb."""
    head = [
        Piece("shade", Mesh(solids.dome(0.4 * _bell(draw), 0.015, 56)), finishes.opaque(draw)),
        *bulbs.hung(draw, 0.07, (0, 0, 0.0), "bulb_", simple=False),
    ]
    elbow, wrist = np.array([-0.45, 0, 0.25]), np.array([0.35, 0, 0.75])
    tilt = draw.number(-0.9, 0.2)
    hold = shift(wrist[0] + 0.1, 0, wrist[2] - 0.1) @ turn("y", tilt) @ shift(z=-0.27)
    foot = revolve([[0, -0.9], [0.4, -0.9], [0.4, -0.85], [0.3, -0.82], [0, -0.82]], 48)
    lower = _rod(np.array([-0.1, 0, -0.8]), elbow, 0.03)
    upper = _rod(elbow + np.array([0.06, 0, 0.08]), wrist - np.array([0.08, 0, 0.03]), 0.025)
    finish = finishes.opaque(draw)
    arm = [Piece("foot", Mesh(foot), finish), Piece("lower", Mesh(lower), finish),
           Piece("upper", Mesh(upper), finish)]  # fmt: skip
    return [*moved(head, hold), *arm]


def spotlight(draw: Draw) -> list[Part]:
    """A mirror of parabolic section with a source at its focus, covered by glass or not."""
    focus = draw.number(0.12, 0.25)
    r = np.linspace(0, 0.8, 33)
    profile = np.stack((r, r**2 / (4 * focus)), 1)
    top = float(profile[-1, 1])
    mirror = Piece("mirror", Mesh(solids.dome(profile, 0.03, 72)), finishes.metal(draw))
    space = Space(0.45 * focus, 0.4 * focus)
    parts: list[Part] = [mirror, *moved(sources.source(draw, space), shift(z=focus))]
    if draw.chance(0.6):
        thick = draw.number(0.04, 0.15)
        low = top + 0.06
        curve = np.linspace(0, 1, 17)
        face = np.stack((0.78 * curve, low + thick + draw.pick((0, 0.15)) * (1 - curve**2)), 1)
        outline = np.concatenate(([[0, low], [0.78, low]], face[::-1]))
        made = finishes.glass(draw, thick).outside
        parts.append(Piece("cover", Mesh(revolve(outline, 64)), made))
    return moved(parts, turn("x", np.pi))


def cone(draw: Draw) -> list[Part]:
    """Analytic shapes alone: a cylinder of thin glass or cloth on a disk, with balls in it."""
    shift_up = np.diag([0.5, 0.5, 1.4, 1.0])
    shift_up[2, 3] = -0.7
    skin = finishes.thin_glass(draw) if draw.chance(0.5) else finishes.cloth(draw)
    metal = finishes.both_sides(finishes.metal(draw))
    disk = shift(z=-0.75, scale=0.6)
    parts: list[Part] = [
        Piece("wall", Primitive("cylinder", shift_up), skin, solid=False),
        Piece("floor", Primitive("disk", disk), metal, solid=False),
    ]
    if draw.chance(0.5):
        roof = Primitive("rectangle", shift(z=0.75, scale=0.55))
        parts.append(Piece("roof", roof, metal, solid=False))
    cloth = "cloth" in skin.traits
    return [*parts, *sources.source(draw, Space(0.35, 0.5), diffused=cloth)]


def balls(draw: Draw) -> list[Part]:
    """Analytic spheres alone: glass in glass, smooth or bumpy, around a shining ball."""
    parts: list[Part] = []
    radius, diffused = 1.0, False
    for layer in range(draw.whole(1, 3)):
        wall = draw.number(0.05, 0.12) * radius
        glass = finishes.glass(draw, wall)
        outside, inside = glass.outside, glass.inside
        diffused |= glass.diffuses
        if draw.chance(0.3):
            outside = inside = finishes.bumpy_glass(draw, radius)
            diffused = False
        inner = radius - wall
        parts += [
            Piece(f"outside_{layer}", Primitive("sphere", shift(scale=radius)), outside),
            Piece(f"inside_{layer}", Primitive("sphere", shift(scale=inner), True), inside),
        ]
        radius = draw.number(0.55, 0.8) * inner
    space = Space(0.65 * radius, 0.65 * radius)
    return [*parts, *sources.source(draw, space, diffused=diffused)]


def _bell(draw: Draw) -> Floats:
    """Outline of a shade from its top on the axis to its rim: cone, bell or bowl."""
    t = np.linspace(0, 1, 33)
    reach, deep = draw.number(0.6, 0.95), draw.number(0.6, 1.0)
    power = draw.pick((0.5, 1.0, 1.8))
    radius = (
        reach * (0.12 * np.minimum(8 * t, 1) + 0.88 * t ** (1 / power))
        if power >= 1
        else (reach * np.sin(0.5 * np.pi * t))
    )
    height = 0.52 - deep * t**power if power >= 1 else 0.52 - deep * (1 - np.cos(0.5 * np.pi * t))
    return np.stack((radius, height), 1)


def _rod(start: Floats, end: Floats, radius: float) -> trimesh.Trimesh:
    """A straight round rod."""
    return tube([start, 0.5 * (start + end), end], radius, 12)


def _foot(draw: Draw, top: float) -> list[Part]:
    """A disc and a pole up to `top`."""
    finish: Finish = finishes.opaque(draw)
    disc = revolve([[0, -0.95], [0.4, -0.95], [0.4, -0.9], [0, -0.88]], 48)
    pole = tube([[0, 0, -0.86], [0, 0, 0.5 * (top - 0.86)], [0, 0, top]], 0.03, 16)
    return [Piece("foot", Mesh(disc), finish), Piece("pole", Mesh(pole), finish)]
