"""PureLight's integrator against Mitsuba's own on lamps that both can render."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from tests.support import analytic_lamps as lamps
from tests.support.agreement import SIGNIFICANCE, agree, p_value, passes

DEPTH = 5
PATH = {"type": "path", "max_depth": DEPTH}
T = mi.ScalarTransform4f
TURNED = T().translate([0.1, 0.4, 0.2]).rotate([0.6, 0, 0.8], 70).scale(0.8)
MODES = ("accurate", "fast")
FLOORS = ({"type": "conductor"}, {"type": "roughconductor", "alpha": 0.1})


def ours(mode: str = "accurate", **settings: Any) -> dict[str, Any]:
    return {"type": "purelight", "mode": mode, "max_depth": DEPTH, **settings}


def lamp(path: Path, to_world: Any, **settings: Any) -> dict[str, Any]:
    return {"type": "purelight", "filename": str(path), "to_world": to_world, **settings}


@pytest.fixture(scope="module")
def bundles(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lamps")
    lamps.ball().write(folder / "ball.plux")
    lamps.ball(0.5).write(folder / "tilted.plux")
    lamps.ball(learned=False).write(folder / "unlearned.plux")
    return folder


def stock(ball: lamps.Lamp, folder: Path, to_world: Any, **settings: Any) -> dict[str, Any]:
    return lamps.mitsuba_lamps(ball, folder, to_world, **settings)


@pytest.mark.parametrize("mode", MODES)
def test_one_lamp(bundles: Path, tmp_path: Path, mode: str) -> None:
    to_world = T().translate([0.1, 0.2, 0.3])
    room = lamps.room()
    reference = mi.load_dict(room | stock(lamps.ball(), tmp_path, to_world))
    scene = mi.load_dict(room | {"lamp": lamp(bundles / "ball.plux", to_world)})
    agree(passes(scene, ours(mode)), passes(reference, PATH))


def test_three_percent_would_be_noticed(bundles: Path, tmp_path: Path) -> None:
    to_world = T().translate([0.1, 0.2, 0.3])
    reference = mi.load_dict(lamps.room() | stock(lamps.ball(), tmp_path, to_world))
    brighter = lamp(bundles / "ball.plux", to_world, dimmer=1.03)
    scene = mi.load_dict(lamps.room() | {"lamp": brighter})
    p = p_value(passes(scene, ours()), passes(reference, PATH))
    assert p < SIGNIFICANCE


def test_rotation_scale_and_dimmer(bundles: Path, tmp_path: Path) -> None:
    ball = lamps.ball(0.5)
    reference = mi.load_dict(lamps.room() | stock(ball, tmp_path, TURNED, tilt=0.5, dimmer=2.0))
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(bundles / "tilted.plux", TURNED, dimmer=2.0)})
    agree(passes(scene, ours()), passes(reference, PATH))


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
def test_lamps_of_two_kinds_beside_a_stock_light(bundles: Path, tmp_path: Path, mode: str) -> None:
    small = T().translate([-0.6, 0.6, 0.3]).scale(0.5)
    near = T().translate([-0.2, 0.9, 0.1]).scale(0.4)
    light = {
        "type": "rectangle",
        "to_world": lamps.look_at((0.5, -1.2, 1.2), (0, 0, -0.5)) @ T().scale(0.2),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [1.0, 2.0, 4.0]}},
    }
    room = lamps.room() | {"light": light}
    other, tilt = ("ball.plux", 0.0) if mode == "fast" else ("tilted.plux", 0.5)
    scene = mi.load_dict(
        room
        | {
            "a": lamp(bundles / "unlearned.plux", small, dimmer=3.0),
            "b": lamp(bundles / other, TURNED),
            "c": lamp(bundles / "unlearned.plux", near),
        }
    )
    reference = mi.load_dict(
        room
        | stock(lamps.ball(), tmp_path, small, dimmer=3.0)
        | stock(lamps.ball(tilt), tmp_path, TURNED, tilt=tilt)
        | stock(lamps.ball(), tmp_path, near)
    )
    agree(passes(scene, ours(mode)), passes(reference, PATH))


@pytest.mark.slow
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(
    "floor",
    [{"type": "conductor"}, {"type": "roughconductor", "alpha": 0.1}],
    ids=["flat", "rough"],
)
def test_reflection(bundles: Path, tmp_path: Path, mode: str, floor: dict[str, Any]) -> None:
    to_world = T().translate([-0.3, 0.2, 0.2])
    room = lamps.room(floor=floor)
    reference = mi.load_dict(room | stock(lamps.ball(), tmp_path, to_world))
    scene = mi.load_dict(room | {"lamp": lamp(bundles / "ball.plux", to_world)})
    agree(passes(scene, ours(mode)), passes(reference, PATH))


@pytest.mark.parametrize("mode", MODES)
def test_floor_through_the_bounding_sphere(bundles: Path, tmp_path: Path, mode: str) -> None:
    to_world = T().translate([-0.3, 0.2, -0.75])
    reference = mi.load_dict(lamps.room() | stock(lamps.ball(), tmp_path, to_world))
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(bundles / "ball.plux", to_world)})
    agree(passes(scene, ours(mode)), passes(reference, PATH), 0.02)


def sheet_room() -> dict[str, Any]:
    """A lamp of Mitsuba's and a sky; what crosses `SHEET` on its way is attenuated."""
    light = {
        "type": "rectangle",
        "to_world": lamps.look_at((0.2, 0.1, 1.4), (0.2, 0.1, 0)) @ T().scale(0.3),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 8.0}},
    }
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": [0.2, 0.3, 0.5]}}
    return lamps.room() | {"light": light, "sky": sky}


SHEET = T().translate([-0.1, 0.3, -0.1]).scale(2.5)


def test_stock_lights_through_a_sheet(tmp_path: Path) -> None:
    through = 0.4
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}}
    two_sided = {"type": "twosided", "bsdf": black}
    local = T().translate(list(lamps.CENTRE)).scale(lamps.RADIUS / math.sqrt(2))
    sheet = {
        "type": "rectangle",
        "to_world": SHEET @ local,
        "bsdf": {"type": "mask", "opacity": 1 - through, "nested": two_sided},
    }
    lamps.glass_sheet([through] * 3).write(tmp_path / "sheet.plux")
    reference = mi.load_dict(sheet_room() | {"sheet": sheet})
    scene = mi.load_dict(sheet_room() | {"sheet": lamp(tmp_path / "sheet.plux", SHEET)})
    volpath = {"type": "volpath", "max_depth": DEPTH}
    agree(passes(scene, ours()), passes(reference, volpath))


def test_coloured_transmittance_treats_channels_apart(tmp_path: Path) -> None:
    pictures = []
    for index, through in enumerate([[0.4] * 3, [0.4, 0.7, 0.7], [0.7, 0.4, 0.1]]):
        path = lamps.glass_sheet(through).write(tmp_path / f"sheet{index}.plux")
        scene = mi.load_dict(sheet_room() | {"sheet": lamp(path, SHEET)})
        pictures.append(passes(scene, ours(), spp=4, count=1))
    grey, red, green = pictures
    np.testing.assert_allclose(red[..., 0], grey[..., 0], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(green[..., 1], grey[..., 1], rtol=1e-4, atol=1e-6)
    assert red[..., 1].mean() > 1.02 * grey[..., 1].mean()


def test_overlapping_lamps_are_crossed_once_each(tmp_path: Path) -> None:
    """Two sheets, one behind the other, in touching bounding spheres, and a third far away."""
    path = lamps.glass_sheet([0.5] * 3).write(tmp_path / "sheet.plux")
    sky = {"type": "constant", "radiance": {"type": "rgb", "value": 1.0}}
    sensor = lamps.room()["sensor"] | {
        "fov": 2,
        "to_world": mi.ScalarTransform4f().look_at([0.3, -0.2, 5], [0.3, -0.2, 0], [1, 0, 0]),
    }
    sheets = {f"s{k}": lamp(path, T().translate([0, 0, z])) for k, z in enumerate((0, 0.05, -2.0))}
    scene = mi.load_dict({"type": "scene", "sensor": sensor, "sky": sky} | sheets)
    image = passes(scene, ours(), spp=1, count=1)
    np.testing.assert_allclose(image, 0.125, rtol=1e-5)


def test_hidden_lamps_still_light_the_room(bundles: Path) -> None:
    to_world = T().translate([0.1, 0.2, 0.3])
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(bundles / "ball.plux", to_world)})
    shown = passes(scene, ours(), count=2)
    hidden = passes(scene, ours(hide_emitters=True), count=2)
    covered = shown[0, ..., 0] > 1.5
    assert covered.any()
    assert hidden[0, ..., 0][covered].max() < 1.0
    np.testing.assert_allclose(hidden[:, 6:], shown[:, 6:], rtol=1e-5)


@pytest.mark.parametrize("mode", MODES)
def test_spoilt_answers_are_dark_and_counted(tmp_path: Path, mode: str) -> None:
    path = lamps.ball(spoilt=True).write(tmp_path / "spoilt.plux")
    to_world = T().translate([0.1, 0.2, 0.3])
    scene = mi.load_dict(lamps.room() | {"lamp": lamp(path, to_world)})
    integrator = mi.load_dict(ours(mode))
    with pytest.warns(UserWarning, match="infinite or no number"):
        image = passes(scene, integrator, spp=4, count=1)
    assert np.isfinite(image).all()
    assert integrator.spoilt > 0


def small_scene(bundle: Path, room_scale: float, lamp_scale: float) -> Any:
    """The whole room scaled, and the lamp in it with the same power."""
    size = T().scale(room_scale)
    room = lamps.room()
    for name in ("floor", "wall"):
        room[name]["to_world"] = size @ room[name]["to_world"]
    origin, target = np.array([2.2, 1.2, 1.4]) * room_scale, np.array([0, 0, 0.3]) * room_scale
    clip = {"near_clip": 1e-3 * room_scale, "far_clip": 100 * room_scale}
    room["sensor"] |= {"to_world": lamps.look_at(list(origin), list(target)), **clip}
    to_world = size @ T().translate([0.1, 0.2, 0.3]).scale(lamp_scale)
    return mi.load_dict(room | {"lamp": lamp(bundle, to_world, dimmer=1 / lamp_scale**2)})


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("room_scale", "lamp_scale"), [(1e-3, 0.01), (1e3, 0.01), (1, 1e-3)])
def test_sizes_from_millimetres_to_kilometres(
    bundles: Path, mode: str, room_scale: float, lamp_scale: float
) -> None:
    settings = ours(mode, hide_emitters=True)
    expected, found = (
        passes(small_scene(bundles / "ball.plux", *scales), settings, count=2)
        for scales in ((1, 0.01), (room_scale, lamp_scale))
    )
    np.testing.assert_allclose(found.mean((0, 1, 2)), expected.mean((0, 1, 2)), rtol=0.01)
