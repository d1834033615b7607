"""The room: closed, clear of the lamp, and lit alike by lamps of equal flux."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from trimesh.triangles import closest_point

from purelight_examples.luminaires import frosted_globe
from purelight_examples.scenes import room
from purelight_examples.scenes.lamp_choice import NeuralLamp, RealLamp, SphereLamp
from purelight_mitsuba import platform

SMALL = room.Picture(24, 18, 64)
LAMP_CENTER, LAMP_RADIUS = np.array([0, 0, 0.021]), 0.0715


def test_lamp_hangs_clear_of_everything() -> None:
    center = np.array(room.LAMP_AT) + LAMP_CENTER
    for part in room.parts():
        triangles = part.mesh.triangles
        nearest = closest_point(triangles, np.tile(center, (len(triangles), 1)))
        assert np.linalg.norm(nearest - center, axis=1).min() > LAMP_RADIUS * 1.05, part.name


def test_room_is_closed(tmp_path: Path) -> None:
    mi = platform.use()
    scene = mi.load_file(str(room.write(tmp_path, SphereLamp((1.0, 1.0, 1.0)), SMALL)))
    direction = np.random.default_rng(0).normal(size=(3, 10_000))
    direction /= np.linalg.norm(direction, axis=0)
    origin = mi.Point3f(*room.CAMERA)
    assert np.array(scene.ray_test(mi.Ray3f(origin, mi.Vector3f(direction)))).all()


def test_real_lamp_and_a_sphere_of_its_flux_light_the_room_alike(tmp_path: Path) -> None:
    mi = platform.use()
    real = RealLamp(frosted_globe.write(tmp_path / "lamp"), "ptracer")
    scenes = [
        room.write(tmp_path, real, SMALL, "real"),
        room.write(tmp_path, SphereLamp((2.99, 1.25, 0.318)), SMALL, "sphere"),
    ]
    images = [np.array(mi.render(mi.load_file(str(scene)), seed=1)) for scene in scenes]
    middle = [np.median(image, axis=(0, 1)) for image in images]
    np.testing.assert_allclose(middle[0], middle[1], rtol=0.15)


def test_bundle_is_named_from_the_scene(tmp_path: Path) -> None:
    scene = room.write(tmp_path / "scene", NeuralLamp(tmp_path / "lamp.plux", "fast"), SMALL)
    root = ET.parse(scene).getroot()
    filename = root.find("emitter[@type='purelight']/string[@name='filename']")
    assert filename is not None
    assert filename.attrib["value"] == "../lamp.plux"
    mode = root.find("integrator[@type='purelight']/string[@name='mode']")
    assert mode is not None
    assert mode.attrib["value"] == "fast"


@pytest.mark.parametrize("plugin", ["path", "ptracer"])
def test_real_lamp_brings_its_shapes_to_its_place(plugin: str, tmp_path: Path) -> None:
    mi = platform.use()
    lamp = frosted_globe.write(tmp_path / "lamp")
    scene = mi.load_file(str(room.write(tmp_path / "room", RealLamp(lamp, plugin), SMALL)))
    glass = next(shape for shape in scene.shapes() if shape.id() == "outside")
    middle = (np.array(glass.bbox().min) + np.array(glass.bbox().max))[:2] / 2
    np.testing.assert_allclose(middle, room.LAMP_AT[:2], atol=1e-4)
