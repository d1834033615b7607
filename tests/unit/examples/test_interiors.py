"""The gallery's rooms: they load, their lamps hang free, and they are lit by them alone."""

from __future__ import annotations

import dataclasses
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.scenes.interior import Interior
from purelight_examples.scenes.interiors import INTERIORS
from purelight_examples.scenes.lamp_choice import NeuralLamp, SphereLamp
from purelight_examples.scenes.sensor import Picture
from purelight_format.errors import PureLightError
from purelight_mitsuba import platform

SMALL = Picture(16, 12, 4)
CROSS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


@pytest.fixture(params=INTERIORS.values(), ids=INTERIORS.keys())
def room(request: pytest.FixtureRequest) -> Interior:
    return request.param


def lit(room: Interior, folder: Path) -> Path:
    """The room with plain spheres for lamps."""
    return room.write(folder, dict.fromkeys(room.places(), SphereLamp((1, 1, 1), 0.02)), SMALL)


def boxes(room: Interior) -> np.ndarray:
    """Corners of the boxes around all parts of all lamps, in the room: [parts, 8, 3]."""
    found = []
    for name, places in room.places().items():
        bounds = np.array([part.mesh.bounds for part in CATALOG[name].lamp.parts()])
        middle, half = bounds.mean(1)[:, None], 0.5 * np.ptp(bounds, axis=1)[:, None]
        for place in places:
            c, s = np.cos(np.radians(place.turn)), np.sin(np.radians(place.turn))
            turned = (middle + CROSS * half) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
            found.append(place.scale * turned + place.at)
    return np.concatenate(found)


def test_lamps_meet_nothing(room: Interior, tmp_path: Path) -> None:
    """No wall or furniture between the corners of boxes around a lamp's parts."""
    mi = platform.use()
    parts = [part for part in room.parts() if part.name != "cord"]
    bare = mi.load_dict({
        "type": "scene",
        **{p.name: {"type": "ply", "filename": str(_ply(p.mesh, tmp_path, p.name))} for p in parts},
    })  # fmt: skip
    corners = boxes(room)
    first, last = np.triu_indices(8, 1)
    a, b = corners[:, first].reshape(-1, 3), corners[:, last].reshape(-1, 3)
    apart = (a != b).any(1)  # LEDs are flat
    a, b = a[apart], b[apart]
    assert not np.array(bare.ray_test(segments(mi, a, b))).any()
    sunk = a - (0, 0, 3.0)  # the same, moved through the floor
    assert np.array(bare.ray_test(segments(mi, a, sunk))).all()


def segments(mi: object, a: np.ndarray, b: np.ndarray) -> object:
    """Rays from a to b, [N, 3]."""
    length = np.linalg.norm(b - a, axis=1)
    ray = mi.Ray3f(mi.Point3f(a.T), mi.Vector3f(((b - a) / length[:, None]).T))  # type: ignore[attr-defined]
    ray.maxt = mi.Float(length)  # type: ignore[attr-defined]
    return ray


def _ply(mesh: object, folder: Path, name: str) -> Path:
    path = folder / f"{name}.ply"
    mesh.export(path)  # type: ignore[attr-defined]
    return path


def test_is_lit_by_its_lamps_and_by_day(room: Interior, tmp_path: Path) -> None:
    mi = platform.use()
    night = mi.load_file(str(lit(room, tmp_path / "night")))
    assert len(night.emitters()) == sum(len(places) for places in room.places().values())
    day = mi.load_file(str(lit(dataclasses.replace(room, daylight=5.0), tmp_path / "day")))  # type: ignore[type-var]
    assert len(day.emitters()) == len(night.emitters()) + (room.window() is not None)
    assert np.array(mi.render(night, spp=4)).max() > 0


def test_the_camera_looks_into_the_room(room: Interior, tmp_path: Path) -> None:
    """It stands within the walls, or before the open side; what it sees is not right before it."""
    mi = platform.use()
    scene = mi.load_file(str(lit(room, tmp_path)))
    view = room.view()
    origin, target = np.array([view.origin]), np.array([view.target])
    near = origin + 0.4 * (target - origin) / np.linalg.norm(target - origin)
    assert not np.array(scene.ray_test(segments(mi, origin, near))).any()
    box = scene.bbox()
    assert box.min.z <= view.origin[2] <= box.max.z


def test_bundles_are_named_from_the_scene(room: Interior, tmp_path: Path) -> None:
    lamps = {name: NeuralLamp(tmp_path / f"{name}.plux") for name in room.places()}
    root = ET.parse(room.write(tmp_path / "room", lamps, SMALL)).getroot()
    emitters = root.findall("emitter[@type='purelight']")
    named = [e.find("string").attrib["value"] for e in emitters]  # type: ignore[union-attr]
    wanted = [f"../{name}.plux" for name, places in room.places().items() for _ in places]
    assert named == wanted
    assert len({e.attrib["id"] for e in emitters}) == len(emitters)


def test_a_hall_has_dozens_of_one_lamp() -> None:
    places = INTERIORS["elevator_hall"].places()
    assert len(places) == 1
    assert sum(len(found) for found in places.values()) == 40


def test_a_missing_lamp_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="kitchen: needs a lamp for linear_led"):
        INTERIORS["kitchen"].write(tmp_path, {"cluster": SphereLamp((1, 1, 1))})
    assert not list(tmp_path.iterdir())
