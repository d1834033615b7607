"""Hollow glass bodies of revolution: bulbs with a neck, vessels of any outline, capsules."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.zoo.lamps import finishes, sources
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.finishes import Glass
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.pieces import Part, Piece, moved
from benchmarks.zoo.lamps.placement import shift
from benchmarks.zoo.lamps.sources import Space
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import globe_profile, inset, revolve
from purelight_examples.luminaires.solids import Floats

GAP = 0.02
BULB_TOP = 1.95  # of a bulb's cap, in radii of its globe


def walled(name: str, profile: ArrayLike, wall: float, glass: Glass, sections: int, *,
           smooth: bool = False) -> list[Part]:  # fmt: skip
    """A hollow body: one piece, or two where the hollow has a finish of its own."""
    outer = revolve(profile, sections)
    hollow = solids.inverted(revolve(inset(profile, wall), sections))
    if glass.inside is glass.outside:
        both = Mesh(solids.joined([outer, hollow]), smooth=smooth)
        return [Piece(name, both, glass.outside)]
    return [
        Piece(name, Mesh(outer, smooth=smooth), glass.outside),
        Piece(f"{name}_hollow", Mesh(hollow, smooth=smooth), glass.inside),
    ]


def nested(draw: Draw, profile: Floats, shells: int) -> list[Part]:
    """Hollow bodies of one outline in each other, and a source in the innermost.

    Arguments:
        profile: [K, 2] of the outermost, star-shaped about the origin.
    """
    parts: list[Part] = []
    scale, diffused = 1.0, False
    for shell in range(shells):
        outline = scale * profile
        near = np.linalg.norm(outline, axis=1).min()
        wall = draw.number(0.03, 0.07) * near
        glass = finishes.glass(draw, wall)
        smooth = draw.chance(0.2)
        diffused |= glass.diffuses
        parts += walled(f"shell_{shell}", outline, wall, glass, 64, smooth=smooth)
        hollow = inset(outline, wall)
        # The next is smaller by what keeps it off the wall wherever the outline slants
        scale *= draw.number(0.62, 0.75)
    clear = 0.6 * float(np.linalg.norm(hollow, axis=1).min())
    return [*sources.source(draw, Space(clear, clear), diffused=diffused), *parts]


def vessel(draw: Draw, waves: float) -> Floats:
    """An outline from nadir to zenith with a radius that swings about one: [K, 2]."""
    polar = np.linspace(0, np.pi, 49)
    swing = [waves * draw.number(-1, 1) / k for k in range(1, 5)]
    radius = np.exp(sum(a * np.cos(k * polar) for k, a in enumerate(swing, 1)))
    profile = radius[:, None] * np.stack((np.sin(polar), -np.cos(polar)), 1)
    profile[[0, -1], 0] = 0
    return profile / np.abs(profile).max()


def capsule(radius: float, half: float, steps: int = 12) -> Floats:
    """A cylinder about Z with round ends, `half` its whole half-length: [K, 2]."""
    t = np.linspace(0, np.pi / 2, steps)
    low = np.stack((radius * np.sin(t), -(half - radius) - radius * np.cos(t)), 1)
    straight = np.linspace(-(half - radius), half - radius, 12)[1:-1]
    middle = np.stack((np.full(10, radius), straight), 1)
    profile = np.concatenate((low, middle, (low * (1, -1))[::-1]))
    profile[[0, -1], 0] = 0
    return profile


def bulb(draw: Draw, *, simple: bool = False, diffused: bool = False) -> list[Part]:
    """A lamp bulb: a globe of radius one about the origin, neck and cap above it."""
    neck = draw.number(0.3, 0.45)
    profile = globe_profile(1.0, neck, 1.5, 16 if simple else 36)
    wall = draw.number(0.03, 0.05)
    glass = finishes.glass(draw, wall)
    space = Space(0.6, 0.6)
    if simple:
        shine = sources.simple_source(draw, space)
    else:
        shine = sources.source(draw, space, diffused=diffused and glass.diffuses)
    smooth = not simple and draw.chance(0.2)
    body = walled("glass", profile, wall, glass, 24 if simple else 56, smooth=smooth)
    return [*shine, *body, cap(draw, neck, simple=simple)]


def bare_bulb(draw: Draw) -> list[Part]:
    """An emitter without glass, of the same size as a bulb and its cap."""
    shine = sources.simple_source(draw, Space(1.0, 1.3))
    return [*shine, cap(draw, 0.35, simple=True)]


def cap(draw: Draw, neck: float, *, simple: bool = False) -> Piece:
    """A screw cap that closes over a neck without touching it."""
    inner, outer, top = neck + GAP, neck + 0.1, BULB_TOP
    t = np.linspace(0, 1, 5 if simple else 33)
    thread = outer - (0 if simple else 0.03) * (1 - np.cos(10 * np.pi * t))
    wall = np.stack((thread, 1.3 + (top - 0.1 - 1.3) * t), 1)
    hollow = [[0.0, 1.5 + GAP], [inner, 1.5 + GAP], [inner, 1.3]]
    profile = np.concatenate((hollow, wall, [[0.5 * outer, top], [0.0, top]]))
    return Piece("cap", Mesh(revolve(profile, 20 if simple else 40)), finishes.metal(draw))


def hung(draw: Draw, size: float, at: ArrayLike, prefix: str, *, simple: bool = True,
         up: bool = False) -> list[Part]:  # fmt: skip
    """A bulb whose globe of that radius is centred at a point; `up` stands it on its cap."""
    parts = bulb(draw, simple=simple) if draw.chance(0.75) else bare_bulb(draw)
    x, y, z = np.asarray(at, np.float64)
    matrix = shift(x, y, z, size)
    if up:
        flip = np.diag([1.0, -1.0, -1.0, 1.0])
        matrix = matrix @ flip
    return moved(parts, matrix, prefix)
