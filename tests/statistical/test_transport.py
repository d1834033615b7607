"""Exactness of light transport: PureLight's lamps against Mitsuba's own, in every configuration.

The quick tests gather several configurations in one scene each; the slow ones take them apart and
look closer.
"""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from tests.support import analytic_lamps as lamps
from tests.support import twins
from tests.support.agreement import SIGNIFICANCE, agree, passes
from tests.support.twins import Ball, Dome, Hanging, Panel, T

DEPTH = 5
R = lamps.RADIUS
RGB = (0.3, 0.6, 0.9)
ROUGH = {"type": "roughconductor", "alpha": 0.15}
BOTH, ACCURATE = ("accurate", "fast"), ("accurate",)
ENGINES = ("fused", "queued")


def grey(value: float = 0.6) -> dict[str, Any]:
    diffuse = {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}
    return {"type": "twosided", "bsdf": diffuse}


def at(*point: float, turn: float = 0.0, scale: float = 1.0) -> Any:
    """Centre of the lamp at a point, turned about an oblique axis, and scaled."""
    turned = T().translate(list(point)).rotate([0.6, 0, 0.8], turn).scale(scale)
    return turned @ T().translate([-c for c in lamps.CENTRE])


def sky() -> dict[str, Any]:
    """An even sky, and two specks that tell Mitsuba how large the scene is: rectangles do not."""
    specks = {
        f"speck{k}": {"type": "cube", "to_world": T().translate([k] * 3).scale(1e-3)}
        for k in (-6, 6)
    }
    return specks | {
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.5]}}
    }


def stock_light(size: float = 0.3) -> dict[str, Any]:
    return {
        "type": "rectangle",
        "to_world": lamps.look_at((0.4, 0.6, 1.4), (0, 0, -0.5)) @ T().scale(size),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [2.0, 4.0, 6.0]}},
    }


def thin_lens(room: dict[str, Any]) -> dict[str, Any]:
    sensor = room["sensor"] | {"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 2.5}
    return room | {"sensor": sensor}


def camera(origin: tuple[float, ...], target: tuple[float, ...], fov: float = 70) -> dict[str, Any]:
    look = {"fov": fov, "to_world": lamps.look_at(origin, target), "near_clip": 1e-3}
    return lamps.room()["sensor"] | look


def rectangle(to_world: Any, bsdf: dict[str, Any] | None = None) -> dict[str, Any]:
    return {"type": "rectangle", "to_world": to_world, "bsdf": bsdf or grey()}


# Rooms and what hangs in them. Balls fill their spheres, so their radiance maps are exact; panels
# have maps that are dark, so fast mode can only be exact where they are dark themselves, or where
# all that they light is inside their bounding spheres.

Setting = tuple[dict[str, Any], list[Hanging]]


def rough_conductor() -> Setting:
    return lamps.room(floor=ROUGH), [Hanging(Ball(), at(0, 0.2, 0, turn=40))]


def lobe_on_rough_conductor() -> Setting:
    return lamps.room(floor=ROUGH), [Hanging(Panel(exponent=4), at(0, 0.2, 0, turn=40, scale=2))]


def many_lights() -> Setting:
    hangings = [
        Hanging(Ball(), at(0.2, 0.1, 0.1, turn=70, scale=0.8)),
        Hanging(Ball(learned=False), at(-0.5, 0.7, 0, scale=0.5), dimmer=3.0),
    ]
    return lamps.room() | {"light": stock_light()}, hangings


def overlapping_balls() -> Setting:
    hangings = [Hanging(Ball(), at(0, 0, 0)), Hanging(Ball(), at(0.2, 0.2, 0.1), dimmer=2.0)]
    return lamps.room(), hangings


def overlapping_panels() -> Setting:
    hangings = [
        Hanging(Panel(through=RGB), at(0, 0, 0, scale=2)),
        Hanging(Panel(exponent=4), at(0.1, 0.2, 0.2, turn=30, scale=2), dimmer=2.0),
    ]
    return lamps.room() | {"light": stock_light()}, hangings


def shadows_in_colour() -> Setting:
    hangings = [
        Hanging(Panel(level=0, through=RGB), at(0, 0.2, -0.2, scale=3)),
        Hanging(Ball(), at(-0.2, 0, 0.6)),
    ]
    return lamps.room() | {"light": stock_light()} | sky(), hangings


def one_before_another() -> Setting:
    """A shining sheet, another, a ball and the sky in the camera's line."""
    hangings = [
        Hanging(Panel(through=RGB, level=0.3), at(0.9, 0.5, 0.4, turn=-80, scale=2.5)),
        Hanging(Panel(through=(0.9, 0.5, 0.7), level=0.2), at(0.2, 0.1, 0.1, turn=-60, scale=2)),
        Hanging(Ball(), at(-0.3, -0.1, 0.2)),
    ]
    return lamps.room() | sky(), hangings


def camera_inside() -> Setting:
    room = lamps.room() | {"sensor": camera((0.1, 0.1, -0.15), (-0.3, -0.1, -0.3))}
    return room, [Hanging(Panel(exponent=4), at(0, 0, 0, scale=2))]


def points_inside() -> Setting:
    """The floor cuts the sphere of a lamp whose stated flux comes from one of its triangles."""
    room = lamps.room() | {"sensor": camera((1.2, 0.6, 0.2), (0, 0, -0.5), 45)}
    return room, [Hanging(Panel(flux_on=(1.0, 0.0)), at(0, 0.2, -0.5, turn=-25, scale=2))]


def all_inside() -> Setting:
    """A small floor and the camera in the sphere of a panel."""
    floor = rectangle(T().translate([0, 0, -0.2]).scale(0.15))
    ball = {"type": "sphere", "center": [0.1, 0.1, -0.12], "radius": 0.06, "bsdf": ROUGH}
    sensor = camera((0.25, 0.2, -0.05), (0, 0, -0.15))
    room = {"type": "scene", "sensor": sensor, "floor": floor, "ball": ball}
    return room, [Hanging(Panel(exponent=4), at(0, 0, 0, turn=20, scale=2))]


def in_the_dome() -> Setting:
    """A room inside a ball."""
    floor = rectangle(T().translate([0, 0, -0.1]).scale(0.15), grey(0.4))
    ball = {"type": "sphere", "center": [0.02, 0.05, -0.05], "radius": 0.05, "bsdf": ROUGH}
    room = {"type": "scene", "sensor": camera((0.15, 0.1, 0.05), (0, 0, -0.1))}
    return room | {"floor": floor, "ball": ball}, [Hanging(Dome(), at(0, 0, 0))]


def recessed() -> Setting:
    """A panel at the top of a box above a hole in the ceiling; the sphere is cut by the ceiling."""
    height, half, depth = 0.6, 0.2, 0.06
    room = lamps.room()
    for index, (x, y) in enumerate(((1, 0), (-1, 0), (0, 1), (0, -1))):
        # Each strip covers one side of the hole; those along x also cover the corners.
        middle = T().translate([x * (half + 0.5), y * (half + 0.5), height])
        size = [0.5, half + 1, 1] if x else [half, 0.5, 1]
        room[f"ceiling{index}"] = rectangle(middle @ T().scale(size))
        side = T().translate([x * half, y * half, height + depth / 2])
        turned = side.rotate([0, 1, 0], 90) if x else side.rotate([1, 0, 0], 90)
        size = [depth / 2, half, 1] if x else [half, depth / 2, 1]
        room[f"side{index}"] = rectangle(turned @ T().scale(size))
    room["sensor"] = camera((1.0, 0.8, 0.0), (-0.1, 0, 0.5))
    return room, [Hanging(Panel(), at(0, 0, height + depth, scale=0.2 / twins.SIDE))]


def on_the_wall() -> Setting:
    """A panel a millimetre before the wall, shining into the room."""
    facing = T().translate([-0.999, 0.1, 0.3]).rotate([0, 1, 0], -90).scale(1.5)
    room = lamps.room() | {"sensor": camera((0.6, 0.9, 0.5), (-1, 0.1, 0.1))}
    return room, [Hanging(Panel(exponent=4), facing @ T().translate([-c for c in lamps.CENTRE]))]


def sunk_in_the_wall() -> Setting:
    """A ball of which the wall shows one half."""
    return lamps.room(), [Hanging(Ball(), at(-1, 0.2, 0.1, turn=30))]


def mirrors_and_glass() -> Setting:
    mirror = {"type": "conductor", "material": "none"}
    room = lamps.room(wall={"type": "twosided", "bsdf": mirror})
    room["globe"] = {
        "type": "sphere", "center": [0.9, 0.3, 0.3], "radius": 0.25,
        "bsdf": {"type": "dielectric"},
    }  # fmt: skip
    room["window"] = rectangle(
        lamps.look_at((0.6, 0.9, 0.4), (0, 0.1, 0)) @ T().scale(0.3), {"type": "thindielectric"}
    )
    return room, [Hanging(Ball(), at(-0.1, 0.1, 0.1, turn=70))]


def before_the_sky() -> Setting:
    hangings = [
        Hanging(Ball(), at(0.3, 0.3, 0.2, scale=0.7)),
        Hanging(Panel(level=0, through=RGB), at(0, 0, 0.5, turn=50, scale=2)),
    ]
    return lamps.room() | sky(), hangings


def through_a_lens() -> Setting:
    room, hangings = many_lights()
    return thin_lens(room), hangings


def mixed() -> Setting:
    """Several lamps that overlap, a stock light, the sky, a lens and a rough conductor."""
    room, hangings = many_lights()
    room = thin_lens(room | sky() | {"floor": rectangle(room["floor"]["to_world"], ROUGH)})
    return room, [*hangings, *sunk_in_the_wall()[1], *overlapping_balls()[1]]


CLOSER = [
    (rough_conductor, BOTH),
    (lobe_on_rough_conductor, ACCURATE),
    (many_lights, BOTH),
    (overlapping_balls, BOTH),
    (overlapping_panels, ACCURATE),
    (shadows_in_colour, BOTH),
    (one_before_another, ACCURATE),
    (camera_inside, ACCURATE),
    (points_inside, ACCURATE),
    (all_inside, BOTH),
    (in_the_dome, BOTH),
    (recessed, ACCURATE),
    (on_the_wall, ACCURATE),
    (sunk_in_the_wall, BOTH),
    (mirrors_and_glass, BOTH),
    (before_the_sky, BOTH),
    (through_a_lens, BOTH),
]
QUICK = [
    (mixed, BOTH),
    (overlapping_panels, ACCURATE),
    (shadows_in_colour, BOTH),
    (one_before_another, ACCURATE),
    (all_inside, BOTH),
    (points_inside, ACCURATE),
    (recessed, ACCURATE),
    (mirrors_and_glass, BOTH),
]


def compare(
    setting: Any,
    modes: tuple[str, ...],
    folder: Path,
    *,
    size: int,
    spp: int,
    tolerance: float,
    engines: tuple[str, ...] = ("fused",),
    depth: int = DEPTH,
) -> None:
    room, hangings = setting()
    film = room["sensor"]["film"] | {"width": size, "height": size}
    room = room | {"sensor": room["sensor"] | {"film": film}}
    ours, stock = twins.twins(folder, room, hangings)
    sheets = any(getattr(hanging.kind, "through", None) for hanging in hangings)
    reference = {"type": "volpath" if sheets else "path", "max_depth": depth}
    expected = passes(stock, reference, spp * 2, first=1000)
    for mode, engine in itertools.product(modes, engines):
        settings = {"mode": mode, "engine": engine, "max_depth": depth}
        agree(passes(ours, {"type": "purelight"} | settings, spp), expected, tolerance)


def named(cases: list[Any]) -> Any:
    return pytest.mark.parametrize(
        ("setting", "modes"), cases, ids=[setting.__name__ for setting, _ in cases]
    )


@named(QUICK)
def test_at_a_glance(setting: Any, modes: tuple[str, ...], tmp_path: Path) -> None:
    compare(setting, modes, tmp_path, size=16, spp=48, tolerance=0.03)


def test_a_sky_is_shadowed_however_small_mitsuba_takes_the_scene(tmp_path: Path) -> None:
    room, hangings = before_the_sky()
    bare = {name: part for name, part in room.items() if not name.startswith("speck")}
    integrator = {"type": "purelight", "max_depth": 2}
    found, expected = (
        passes(twins.twins(tmp_path, scene, hangings)[0], integrator, 64, first=first)
        for first, scene in enumerate((bare, room))
    )
    agree(found, expected)


@pytest.mark.slow
@named(CLOSER)
def test_closer(setting: Any, modes: tuple[str, ...], tmp_path: Path) -> None:
    compare(setting, modes, tmp_path, size=32, spp=256, tolerance=0.01, engines=ENGINES)


# A strip of floor from inside the bounding sphere of a panel above it to outside.

PIXELS, HALF, HEIGHT, ALBEDO = 64, 0.35, 0.3, 0.5
EDGE = math.sqrt(1 - HEIGHT**2)  # Where the sphere, of radius one, cuts the floor.


def strip(folder: Path) -> mi.Scene:
    hanging = Hanging(Panel(), at(0, 0, HEIGHT, scale=1 / R))
    film = {"type": "hdrfilm", "width": PIXELS, "height": 1, "rfilter": {"type": "box"}}
    look = T().look_at([EDGE, 0, 2], [EDGE, 0, 0], [0, 1, 0]) @ T().scale(HALF)
    sensor = {"type": "orthographic", "film": film, "to_world": look}
    floor = rectangle(T().scale(5), grey(ALBEDO))
    ours, _ = twins.twins(folder, {"type": "scene", "sensor": sensor, "floor": floor}, [hanging])
    return ours


def profile(scene: mi.Scene, mode: str, count: int, spp: int) -> np.ndarray:
    """Independent renderings of the strip by x: [count, PIXELS], of the red channel."""
    settings = {"type": "purelight", "mode": mode, "max_depth": 2, "hide_emitters": True}
    integrator = mi.load_dict(settings)
    images = [mi.render(scene, integrator=integrator, spp=spp, seed=k) for k in range(count)]
    return np.array([np.array(image)[0, :, 0] for image in images], np.float64)


def true_profile() -> np.ndarray:
    """Floor radiance below a Lambertian square, each pixel's mean: the closed-form factor."""
    width = 2 * HALF / PIXELS
    steps = (np.arange(16) + 0.5) / 16
    x = EDGE - HALF + width * (np.arange(PIXELS)[:, None, None] + steps[:, None])
    y = width * (steps - 0.5) + 0 * x
    side = math.sqrt(0.5)
    factor = np.zeros_like(y)
    for sx in (1, -1):
        for sy in (1, -1):
            a, b = (side - sx * x) / HEIGHT, (side - sy * y) / HEIGHT
            ra, rb = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
            factor += (a / ra * np.arctan(b / ra) + b / rb * np.arctan(a / rb)) / (2 * math.pi)
    return ALBEDO * lamps.COLOUR[0] * factor.mean((1, 2))


def test_no_seam_at_the_sphere(tmp_path: Path) -> None:
    """Right in every pixel of the strip, and nowhere a sudden change of the noise."""
    pictures = profile(strip(tmp_path), "accurate", 64, 64)
    error = pictures.std(0, ddof=1)
    t = (pictures.mean(0) - true_profile()) / (error / math.sqrt(len(pictures)))
    p = -np.expm1(PIXELS * np.log1p(-2 * stats.t.sf(np.abs(t).max(), len(pictures) - 1)))
    noise = (error / true_profile()).reshape(-1, 4).mean(1)
    steps = np.abs(np.diff(np.log(noise)))
    print(f"p {p:.3g}, noise {noise.round(4)}")
    assert p > SIGNIFICANCE
    assert steps.max() < 0.3


def test_bias_of_a_map_fades_in_outside_the_sphere(tmp_path: Path) -> None:
    """A dark map takes light away outside, gradually from nothing at the sphere on."""
    found = profile(strip(tmp_path), "fast", 64, 256).mean(0) / true_profile()
    inside = np.arange(PIXELS) < PIXELS // 2
    steps = -np.diff(found)
    print(found.round(3))
    np.testing.assert_allclose(found[inside], 1, atol=0.02)
    assert found[-1] < 0.7
    assert steps.max() < 0.15 * (1 - found[-1])
