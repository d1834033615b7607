"""The same lamp in every format gives the same parts, the same light and the same exit surface."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_import import Options, import_lamp
from tests.support.lamp_files import glb, model, obj, usd
from tests.support.lamp_files import mitsuba as writers

WRITERS: dict[str, Callable[[Path], Path]] = {
    "glb": lambda folder: glb.write(folder, model.lamp()),
    "obj": lambda folder: obj.write(folder, model.lamp()),
    "usda": lambda folder: usd.write(folder, model.lamp()),
    "mitsuba 3": lambda folder: writers.write(folder, model.lamp()),
    "mitsuba 0.6": lambda folder: writers.write(folder, model.lamp(), "0.6.0"),
}
OPTIONS = {"mitsuba 0.6": Options(up="z", units="m")}
AREA = 4 * np.pi * model.BULB**2


@pytest.fixture(scope="module", params=WRITERS)
def imported(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, mitsuba: Any
) -> Any:
    folder = tmp_path_factory.mktemp("lamp")
    path = WRITERS[request.param](folder)
    return import_lamp(path, folder / "out", OPTIONS.get(request.param), picture=False)


def test_parts_have_their_names_and_sizes(imported: Any) -> None:
    parts = {row["name"]: row for row in imported.parts}
    assert set(parts) == {"Bulb", "Globe", "Base"}
    np.testing.assert_allclose(parts["Globe"]["size"], [0.12] * 3, atol=1e-5)
    np.testing.assert_allclose(parts["Base"]["size"], [0.05, 0.05, 0.02], atol=1e-5)
    np.testing.assert_allclose(parts["Base"]["center"], [0, 0, 0.08], atol=1e-5)
    assert "glass" in parts["Globe"]["is"]
    assert imported.doubts == []


def test_the_bulb_gives_what_the_file_says(imported: Any) -> None:
    (row,) = [row for row in imported.parts if "lumens" in row]
    expected = np.pi * AREA * LUMENS_PER_WATT * LUMINANCE @ np.array(model.RADIANCE)
    assert row["name"] == "Bulb"
    assert row["lumens"] == pytest.approx(expected, rel=0.02)  # its mesh is a little smaller
    np.testing.assert_allclose(row["radiance"], model.RADIANCE, rtol=1e-4)


def test_the_scene_is_readable_and_flat_where_it_emits(imported: Any) -> None:
    root = ET.parse(imported.scene).getroot()
    shapes = {shape.get("id"): shape for shape in root.findall("shape")}
    assert root.get("version") == "3.0.0"
    flat = shapes["Bulb"].find("boolean[@name='face_normals']")
    assert flat is not None
    assert flat.get("value") == "true"
    for shape in shapes.values():
        (filename,) = (s.get("value") for s in shape.findall("string"))
        assert (imported.scene.parent / filename).is_file()


@pytest.fixture(scope="module")
def direct(tmp_path_factory: pytest.TempPathFactory, mitsuba: Any) -> tuple[Any, Any]:
    """The exit surface, and the share of the light that leaves, of a scene without an import."""
    return seen(writers.write(tmp_path_factory.mktemp("direct"), model.lamp()))


def seen(path: Path) -> tuple[Any, Any]:
    """What training sees of a scene: its exit surface, and the flux that leaves."""
    from purelight_import.sanity.light import leaving
    from purelight_import.sanity.subject import Subject
    from purelight_train.light.luminaire import load_luminaire

    lamp = load_luminaire(path)
    return lamp.exit_surface, leaving(Subject(lamp.scene), paths=1 << 17).left.sum(0)


def test_training_sees_the_same_lamp(imported: Any, direct: tuple[Any, Any]) -> None:
    """Flux that leaves, and the area and sphere of the surface it leaves by."""
    (expected, wanted), (surface, flux) = direct, seen(imported.scene)
    assert surface.area == pytest.approx(expected.area, rel=1e-3)
    assert surface.sphere.radius == pytest.approx(expected.sphere.radius, rel=1e-3)
    np.testing.assert_allclose(surface.sphere.center, expected.sphere.center, atol=1e-4)
    np.testing.assert_allclose(flux, wanted, rtol=0.01)
    emitted = np.pi * model.ball(model.BULB).area * np.array(model.RADIANCE)
    assert (flux < 0.99 * emitted).all()  # Some is taken by brass, and by the black bulb.
