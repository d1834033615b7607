"""What shines: filaments, LEDs, flames, fluorescent tubes, points; all in unit lengths."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh

from benchmarks.zoo.lamps import finishes
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.forms import Mesh, Primitive
from benchmarks.zoo.lamps.pieces import Finish, Light, Part, Piece
from benchmarks.zoo.lamps.placement import shift, turn
from benchmarks.zoo.lamps.plugin import RGB, bsdf
from purelight_examples.luminaires import solids
from purelight_examples.luminaires.parts import helix, revolve, tube

WHITES: tuple[RGB, ...] = ((1, 0.42, 0.11), (1, 0.65, 0.35), (1, 0.85, 0.7), (0.85, 0.92, 1))
COLOURS: tuple[RGB, ...] = (
    (1, 0.03, 0.02), (0.05, 1, 0.08), (0.03, 0.08, 1), (1, 0.6, 0.02), (0.9, 0.1, 0.9),
    (0.05, 0.9, 0.9),
)  # fmt: skip
RADIANCE = 1000.0  # W/(m² sr) of a source of ordinary brightness


@dataclass(frozen=True)
class Space:
    """Empty room for a source: a cylinder about Z through the origin."""

    radius: float
    half_height: float


def source(draw: Draw, space: Space, *, diffused: bool = False) -> list[Part]:
    """Emitters that stay inside a space, and what carries them.

    Arguments:
        diffused: whether what is around scatters light, so that point lights may be used.
    """
    upright = space.half_height > 2 * space.radius
    kinds: dict[str, tuple[Callable[[Draw, Space], list[Part]], float]] = {
        "coil": (_coil, 0 if upright else 3),
        "balls": (_balls, 0 if upright else 2),
        "filaments": (_filaments, 3 if upright else 2),
        "column": (_column, 3),
        "flame": (_flame, 0 if upright else 1.5),
        "stick": (_stick, 3 if upright else 0),
        "puck": (_puck, 0 if upright else 1.5),
        "point": (_points, 8 if diffused else 0),
    }
    make, _ = draw.pick(list(kinds.values()), [weight for _, weight in kinds.values()])
    return [part.named(f"source_{part.name}") for part in make(draw, space)]


def simple_source(draw: Draw, space: Space) -> list[Part]:
    """One emitter with few triangles, for lamps of many."""
    r, h = space.radius, space.half_height
    if draw.chance(0.5):
        mesh = rod((0, 0), 0.8 * h, min(0.35 * r, 0.25 * h), 8)
        return [Piece("source", Mesh(mesh), lamp_black(draw), colour(draw))]
    size = 0.6 * min(r, h)
    return [Piece("source", Primitive("sphere", shift(scale=size)), lamp_black(draw), colour(draw))]


def colour(draw: Draw, saturated: float = 0.25) -> RGB:
    """Radiance of an emitter: white of some temperature, or now and then of one colour."""
    hue = draw.pick(COLOURS) if draw.chance(saturated) else draw.pick(WHITES)
    level = RADIANCE * draw.log(0.3, 3)
    return (level * hue[0], level * hue[1], level * hue[2])


def lamp_black(draw: Draw) -> Finish:
    """What emitters are made of: dark to bright, matt."""
    grey = draw.number(0.1, 0.8)
    return Finish(bsdf("diffuse", reflectance=(grey, grey, grey)), frozenset())


def _coil(draw: Draw, space: Space) -> list[Part]:
    reach = 0.75 * space.radius
    turns, wire = draw.whole(4, 9), draw.number(0.02, 0.035) * reach
    length = 1.6 * reach
    radius = min(draw.number(0.15, 0.3) * reach, 0.5 * space.half_height)
    wire = min(wire, 0.28 * length / turns)
    mesh = tube(helix(turns, radius, length, 16), wire, 8)
    return [Piece("coil", Mesh(mesh), lamp_black(draw), colour(draw, 0.1))]


def _balls(draw: Draw, space: Space) -> list[Part]:
    count = draw.whole(1, 7)
    around = 0.0 if count == 1 else 0.55 * space.radius
    apart = space.radius if count == 1 else 2 * around * np.sin(np.pi / count)
    size = min(draw.number(0.25, 0.42) * apart, 0.35 * space.radius, 0.8 * space.half_height)
    balls: list[Part] = []
    for x, y, z in solids.circle(around, count):
        form: Mesh | Primitive = Primitive("sphere", shift(x, y, z, size))
        if draw.chance(0.5):
            form = Mesh(form.triangles)
        balls.append(Piece(f"ball_{len(balls)}", form, lamp_black(draw), colour(draw)))
    return balls


def _filaments(draw: Draw, space: Space) -> list[Part]:
    """Upright sticks in a ring, as in a bulb of LED filaments."""
    count = draw.whole(2, 6)
    around, half = 0.5 * space.radius, 0.8 * space.half_height
    radius = min(0.06 * space.radius, 0.3 * around)
    sticks: list[Part] = []
    same = colour(draw)
    for x, y, _ in solids.circle(around, count):
        mesh = rod((x, y), half, radius, 8)
        shine = same if draw.chance(0.6) else colour(draw)
        sticks.append(Piece(f"filament_{len(sticks)}", Mesh(mesh), lamp_black(draw), shine))
    return sticks


def _column(draw: Draw, space: Space) -> list[Part]:
    """LEDs on the faces of a prism, up to sixty, hardly two of one brightness."""
    faces = draw.whole(3, 6)
    rows = draw.whole(1, 60 // faces if space.half_height > 3 * space.radius else 4)
    half = 0.8 * space.half_height
    radius = min(0.5 * space.radius, half)
    apothem = radius * np.cos(np.pi / faces)
    side = 0.5 * min(2 * radius * np.sin(np.pi / faces), 2 * half / rows)
    outline = solids.circle(radius, faces)[:, :2]
    parts: list[Part] = [
        Piece("column", Mesh(solids.prism(outline, -half, half)), finishes.opaque(draw))
    ]
    heights = (np.arange(rows) + 0.5) / rows * 2 * half - half
    for face in range(faces):
        about = turn("z", np.pi * (2 * face + 1) / faces)
        for z in heights:
            out = shift(apothem * 1.04 + 0.02 * side, 0, z) @ turn("y", np.pi / 2)
            form = Primitive("rectangle", about @ out @ shift(scale=0.5 * side))
            name = f"led_{len(parts) - 1}"
            parts.append(Piece(name, form, lamp_black(draw), colour(draw), solid=False))
    return parts


def _flame(draw: Draw, space: Space) -> list[Part]:
    half = 0.7 * space.half_height
    t = np.linspace(0, np.pi, 17)
    width = min(0.4 * space.radius, 0.5 * half)
    profile = np.stack((width * np.sin(t) * (1 - 0.35 * np.cos(t + np.pi)), -half * np.cos(t)), 1)
    profile[[0, -1], 0] = 0
    return [Piece("flame", Mesh(revolve(profile, 24)), lamp_black(draw), colour(draw, 0.1))]


def _stick(draw: Draw, space: Space) -> list[Part]:
    """A fluorescent tube."""
    half, radius = 0.85 * space.half_height, draw.number(0.3, 0.6) * space.radius
    mesh = rod((0, 0), half, radius, 24)
    return [Piece("tube", Mesh(mesh), lamp_black(draw), colour(draw, 0.3))]


def _puck(draw: Draw, space: Space) -> list[Part]:
    """A round LED module that shines down from its heat sink."""
    radius, high = 0.55 * space.radius, 0.5 * space.half_height
    body = revolve([[0, 0.02 * high], [radius, 0.02 * high], [radius, high], [0, high]], 32)
    face = turn("x", np.pi) @ shift(scale=0.8 * radius)
    return [
        Piece("sink", Mesh(body), finishes.opaque(draw)),
        Piece("module", Primitive("disk", face), lamp_black(draw), colour(draw), solid=False),
    ]


def _points(draw: Draw, space: Space) -> list[Part]:
    """Point lights or spots without bodies."""
    lights: list[Part] = []
    for at in solids.circle(0.4 * space.radius, draw.whole(1, 4)):
        r, g, b = (space.radius**2 * c for c in colour(draw))
        aim = np.array([0.0, 0.0, -1.0]) if draw.chance(0.4) else None
        cutoff = draw.number(20, 60)
        lights.append(Light(f"point_{len(lights)}", at, (r, g, b), aim, cutoff))
    return lights


def rod(at: tuple[float, float], half: float, radius: float, sides: int) -> trimesh.Trimesh:
    """An upright round rod about a point of the plane z = 0."""
    ends = np.array([[*at, -half], [*at, 0.0], [*at, half]])
    return tube(ends, radius, sides)


def led(draw: Draw, half: float) -> Piece:
    """A square LED at the origin that shines along +Z; half its side."""
    form = Primitive("rectangle", shift(scale=half))
    return Piece("led", form, lamp_black(draw), colour(draw, 0.4), solid=False)
