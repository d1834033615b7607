"""Lamps that answer other light, against Mitsuba's own shapes of the same materials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from purelight_format.members.finishes import Finish
from tests.statistical.test_transport import (
    ACCURATE,
    BOTH,
    ENGINES,
    Setting,
    at,
    compare,
    named,
    sky,
    stock_light,
)
from tests.support import analytic_lamps as lamps
from tests.support import finished_lamps, twins
from tests.support.agreement import SIGNIFICANCE
from tests.support.finished_lamps import MATT, MIRROR, WHITE_METAL, Bubble, FinishedBall, Window
from tests.support.twins import Ball, Hanging, T

PASSES = 16
DEEP = 12  # Sheets of glass are surfaces to Mitsuba; light that goes straight meets none of ours.


def lit_room() -> dict[str, Any]:
    return lamps.room() | {"light": stock_light()} | sky()


def switched_off(finish: Finish) -> Setting:
    return lit_room(), [Hanging(FinishedBall(finish), at(0.2, 0.1, 0.1, turn=70), dimmer=0.0)]


def matt_and_dark() -> Setting:
    return switched_off(MATT)


def rough_and_dark() -> Setting:
    return switched_off(WHITE_METAL)


def polished_and_dark() -> Setting:
    return switched_off(MIRROR)


def lighting_each_other() -> Setting:
    """Two lamps of different materials and one that says nothing, close to each other."""
    hangings = [
        Hanging(FinishedBall(MATT), at(0.2, 0.1, 0.1, turn=70, scale=0.8)),
        Hanging(FinishedBall(WHITE_METAL), at(-0.3, 0.5, 0, scale=0.5), dimmer=3.0),
        Hanging(Ball(), at(0.5, 0.6, -0.1, scale=0.3), dimmer=0.5),
    ]
    return lit_room(), hangings


def in_a_mirror() -> Setting:
    hangings = [
        Hanging(FinishedBall(MIRROR), at(0.2, 0.1, 0.1, turn=70, scale=0.8)),
        Hanging(FinishedBall(MATT, tilt=0.5), at(-0.3, 0.5, 0, scale=0.5), dimmer=3.0),
    ]
    return lit_room(), hangings


def touching() -> Setting:
    """Two lamps whose spheres overlap, half in the wall."""
    hangings = [
        Hanging(FinishedBall(MATT), at(-1, 0.2, 0.1, turn=30)),
        Hanging(FinishedBall(WHITE_METAL), at(-0.8, 0.5, 0.2, turn=30), dimmer=2.0),
    ]
    return lit_room(), hangings


def behind_a_pane() -> Setting:
    hangings = [
        Hanging(Window(), at(0.3, 0.3, 0.2, turn=60, scale=2)),
        Hanging(FinishedBall(MATT), at(-0.3, 0.1, 0.1, scale=0.5)),
    ]
    return lit_room(), hangings


def beside_a_bubble() -> Setting:
    hangings = [
        Hanging(Bubble(), at(0.3, 0.3, 0.2, turn=60, scale=2)),
        Hanging(FinishedBall(MATT), at(-0.3, 0.1, 0.1, scale=0.5)),
    ]
    return lit_room(), hangings


CLOSER = [
    (matt_and_dark, BOTH),
    (rough_and_dark, ACCURATE),
    (polished_and_dark, ACCURATE),
    (lighting_each_other, BOTH),
    (in_a_mirror, ACCURATE),
    (touching, ACCURATE),
    (behind_a_pane, ACCURATE),
    (beside_a_bubble, ACCURATE),
]
QUICK = [(lighting_each_other, ACCURATE), (beside_a_bubble, ACCURATE)]


@named(QUICK)
def test_at_a_glance(setting: Any, modes: tuple[str, ...], tmp_path: Path) -> None:
    compare(setting, modes, tmp_path, size=16, spp=32, tolerance=0.03, depth=DEEP)


@pytest.mark.slow
@named(CLOSER)
def test_closer(setting: Any, modes: tuple[str, ...], tmp_path: Path) -> None:
    compare(setting, modes, tmp_path, size=32, spp=256, tolerance=0.01, engines=ENGINES, depth=DEEP)


# The white furnace: in an even sky of radiance 1, nothing is brighter than 1.

FROST = Finish(
    "frost", (0.1, 0.1, 0.1), roughness=0.6, opacity=0.1, spread=0.7, ahead_exponent=2.0,
    scattered_ahead=(0.2, 0.3, 0.4), scattered_back=(0.5, 0.3, 0.1),
)  # fmt: skip
GLASS = Finish("glass", (0.0, 0.0, 0.0), roughness=0.0, opacity=0.0)
CHALK = Finish("chalk", (1.0, 1.0, 1.0), roughness=0.4)
SHELL = Finish("shell", (0.0, 0.0, 0.0), roughness=0.0, opacity=0.0, thin_walled=True, ior=1.8)


def bowl() -> lamps.Lamp:
    """Half of a ball, of which both sides are seen, that lets through more than there can be."""
    ball = lamps.ball()
    surface = ball.surface
    middle = surface.positions[surface.triangles].mean(1)
    half = middle[:, 2] < lamps.CENTRE[2] + 0.3 * lamps.RADIUS
    networks = ball.networks | {
        "appearance": lamps.black(), "transparency": lamps.transparency((1.0, 1.0, 1.0)),
    }  # fmt: skip
    cut = type(surface)(surface.positions, surface.triangles[half], 0 * surface.triangle_flux[half])
    return lamps.Lamp(cut, networks, np.zeros(3))


FURNACES = [(finish, "accurate", "fused") for finish in (MATT, WHITE_METAL, MIRROR, CHALK, GLASS)]
FURNACES += [
    (finish, mode, engine)
    for finish in (FROST, SHELL) for mode in ("accurate", "fast") for engine in ENGINES
]  # fmt: skip


@pytest.mark.parametrize(
    ("finish", "mode", "engine"), FURNACES, ids=lambda x: x if isinstance(x, str) else x.name
)
def test_a_white_furnace_stays_white_at_most(
    finish: Finish, mode: str, engine: str, tmp_path: Path
) -> None:
    path = finished_lamps.finished(bowl(), finish).write(tmp_path / "bowl.plux")
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    centre = np.array(lamps.CENTRE)
    look = lamps.look_at((centre + np.array([0.6, 0.3, 0.5])).tolist(), centre.tolist())
    sensor = {"type": "perspective", "fov": 40, "film": film, "to_world": look}
    white = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    scene = mi.load_dict({
        "type": "scene", "sensor": sensor, "sky": white,
        "lamp": {"type": "purelight", "filename": str(path)},
    })  # fmt: skip
    integrator = mi.load_dict({
        "type": "purelight", "mode": mode, "engine": engine, "rr_depth": 1000, "max_depth": 64,
    })  # fmt: skip
    images = [
        np.array(mi.render(scene, integrator=integrator, spp=16, seed=k), np.float64)
        for k in range(PASSES)
    ]
    mean, error = np.mean(images, 0), np.std(images, 0, ddof=1) / np.sqrt(PASSES)
    worst = ((mean - 1 - 1e-5) / np.maximum(error, 1e-5)).max()
    p = -np.expm1(mean.size * np.log1p(-stats.t.sf(worst, PASSES - 1)))
    print(f"{finish.name}: brightest {mean.max():.4f}, mean {mean.mean():.4f}, p {p:.3g}")
    assert p > SIGNIFICANCE
    assert mean.min() > 0.02  # It is no hole either.


# Light is not counted twice.


@pytest.mark.parametrize("finish", [MATT, WHITE_METAL, MIRROR], ids=lambda f: f.name)
def test_a_lamp_does_not_light_itself(finish: Finish, tmp_path: Path) -> None:
    """Its own light on its own hollow is what its network says, whatever it is made of."""
    shining = lamps.Lamp(bowl().surface, {"appearance": lamps.appearance()}, np.ones(3))
    flux = np.full((len(shining.surface.triangles), 3), 1 / len(shining.surface.triangles))
    surface = type(shining.surface)(
        shining.surface.positions, shining.surface.triangles, flux.astype(np.float32)
    )
    lamp = finished_lamps.finished(lamps.Lamp(surface, shining.networks, np.ones(3)), finish)
    path = lamp.write(tmp_path / "bowl.plux")
    look = {"to_world": lamps.look_at((1, 0.5, 1), lamps.CENTRE), "fov": 30}
    scene = mi.load_dict({
        "type": "scene", "lamp": {"type": "purelight", "filename": str(path)},
        "sensor": lamps.room(size=16)["sensor"] | look,
    })  # fmt: skip
    integrator = mi.load_dict({"type": "purelight", "max_depth": 6})
    image = np.array(mi.render(scene, integrator=integrator, spp=8))
    shown = image[image[..., 0] > 0]
    assert len(shown) > 50
    assert np.all(shown <= lamps.COLOUR * (1 + 1e-5))
    assert np.isclose(shown.max(0), lamps.COLOUR, rtol=1e-5).all()


def test_light_that_comes_back_from_the_room_counts(tmp_path: Path) -> None:
    """A lamp in a closed white box is brighter than its network says, by what it reflects."""
    box = {"type": "cube", "to_world": T().scale(0.8), "flip_normals": True}
    white = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.5}}
    hangings = [Hanging(FinishedBall(MATT), at(0, 0, 0))]
    look = lamps.look_at((0.7, 0.1, 0), (0, 0, 0))
    room = {"type": "scene", "box": box | {"bsdf": white}}
    room["sensor"] = lamps.room(size=16)["sensor"] | {"to_world": look, "fov": 20}
    ours, stock = twins.twins(tmp_path, room, hangings)
    found, expected = (
        np.array(mi.render(scene, integrator=mi.load_dict({"type": kind}), spp=256)).mean((0, 1))
        for scene, kind in ((ours, "purelight"), (stock, "path"))
    )
    assert np.all(found > 1.005 * lamps.COLOUR)
    np.testing.assert_allclose(found / lamps.COLOUR - 1, expected / lamps.COLOUR - 1, rtol=0.1)
