"""Materials and textures as Mitsuba sees what was written."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.mesh import Mesh
from purelight_import.model.picture import Picture
from purelight_import.write import bsdf
from purelight_import.write.scene import write_scene
from purelight_import.write.textures import Textures

GLASS = Material("Glass", (1.0, 1.0, 1.0), 0.0, 0.0, ior=1.5, transmission=1.0)
# Four colours: upper left red, upper right green, lower left blue, lower right white
COLORS = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
SQUARE = Mesh(
    np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]),
    np.array([[0, 1, 2], [0, 2, 3]], np.uint32), None,
    np.array([[0.0, 1], [1, 1], [1, 0], [0, 0]]),  # the picture's upper edge at y = 1
)  # fmt: skip


def kinds(material: Material, folder: Path, *, solid: bool = False) -> list[str]:
    found = bsdf.elements(material, Textures(folder), solid=solid)
    return [e.get("type", "") for e in found[0].iter("bsdf")] + [e.tag for e in found[1:]]


@pytest.mark.parametrize(
    ("changes", "solid", "expected"),
    [
        ({}, True, ["dielectric"]),
        ({}, False, ["thindielectric"]),
        ({"roughness": 0.5}, True, ["roughdielectric"]),
        ({"roughness": 0.5}, False, ["principledthin"]),
        ({"transmission": 0.6}, True, ["principled"]),
        ({"attenuation": (1.0, 2.0, 300.0)}, True, ["dielectric", "medium"]),
        ({"attenuation": (1.0, 2.0, 3.0)}, False, ["thindielectric"]),
        ({"opacity": 0.5}, True, ["mask", "dielectric"]),
        ({"transmission": 0.0, "metalness": 1.0}, True, ["twosided", "conductor"]),
        ({"transmission": 0.0, "metalness": 1.0, "roughness": 0.4}, True,
         ["twosided", "roughconductor"]),
        ({"transmission": 0.0, "specular": 0.0}, True, ["twosided", "diffuse"]),
        ({"transmission": 0.0}, True, ["twosided", "principled"]),
        ({"transmission": 0.0, "diffuse_transmission": 0.5}, True, ["principledthin"]),
    ],
)  # fmt: skip
def test_which_bsdf_a_material_becomes(
    changes: dict[str, Any], solid: bool, expected: list[str], tmp_path: Path
) -> None:
    assert kinds(replace(GLASS, **changes), tmp_path, solid=solid) == expected


def test_the_index_of_a_weaker_reflection() -> None:
    plain = replace(GLASS, transmission=0.0)
    assert bsdf.index(plain) == pytest.approx(1.5)
    half = bsdf.index(replace(plain, specular=0.5))
    assert ((half - 1) / (half + 1)) ** 2 == pytest.approx(0.02)


def test_absorption_is_beers_law(mitsuba: Any, tmp_path: Path) -> None:
    """A slab 0.5 thick, crossed at right angles between two faces of index one."""
    material = replace(GLASS, ior=1.0, attenuation=(0.5, 1.0, 30.0))
    medium = bsdf.elements(material, Textures(tmp_path), solid=True)[1]
    scale = float(medium.find("float[@name='scale']").get("value"))  # type: ignore[union-attr]
    sigma = [float(x) for x in medium.find("rgb").get("value").split(",")]  # type: ignore[union-attr]
    np.testing.assert_allclose(scale * np.array(sigma), [0.5, 1.0, 30.0])
    assert max(sigma) <= 1  # Mitsuba takes no larger colours


def written(folder: Path, material: Material, **more: Any) -> Path:
    path = folder / "lamp.xml"
    part = Part("Square", SQUARE, material, **more)
    write_scene(path, Lamp("lamp", (part,)), [part], "test")
    return path


def seen(mi: Any, path: Path, *, emission: bool = False) -> np.ndarray:
    """Reflectance, or radiance, at the four quarters: upper left, right, lower left, right."""
    shape = mi.load_file(str(path), optimize=False).shapes()[0]
    x, y = mi.Float([0.25, 0.75, 0.25, 0.75]), mi.Float([0.75, 0.75, 0.25, 0.25])
    scene = mi.load_dict({"type": "scene", "shape": shape})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(x, y, 1), mi.Vector3f(0, 0, -1)))
    if emission:
        return np.array(si.emitter(scene).eval(si)).T
    return np.array(si.bsdf().eval_diffuse_reflectance(si)).T


MATT = Material("Matt", (0.5, 0.5, 0.5), 0.0, 1.0, specular=0.0)
QUARTERS = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]


def test_textures_are_the_right_way_up(mitsuba: Any, tmp_path: Path) -> None:
    picture = Picture("four", COLORS, srgb=True, smooth=False)
    path = written(tmp_path, replace(MATT, base_color=picture))
    np.testing.assert_allclose(seen(mitsuba, path), QUARTERS, atol=1e-3)
    assert (tmp_path / "textures" / "four.png").is_file()


def test_textures_are_moved_by_their_transform(mitsuba: Any, tmp_path: Path) -> None:
    """Turned by half about the middle."""
    turn = np.array([[-1.0, 0, 1], [0, -1, 1], [0, 0, 1]])
    picture = Picture("four", COLORS, srgb=True, smooth=False, to_uv=turn)
    path = written(tmp_path, replace(MATT, base_color=picture))
    np.testing.assert_allclose(seen(mitsuba, path), QUARTERS[::-1], atol=1e-3)


def test_bright_textures_of_light_stay_bright(mitsuba: Any, tmp_path: Path) -> None:
    picture = Picture("four", COLORS, srgb=True, smooth=False).times(250.0)
    path = written(tmp_path, MATT, radiance=picture)
    found = seen(mitsuba, path, emission=True)
    np.testing.assert_allclose(found, 250 * np.array(QUARTERS), rtol=1e-3, atol=1e-3)


def test_darkened_colours_are_baked(mitsuba: Any, tmp_path: Path) -> None:
    picture = Picture("four", COLORS, srgb=True, smooth=False).times((0.5, 0.25, 1.0))
    path = written(tmp_path, replace(MATT, base_color=picture))
    expected = np.array(QUARTERS) * [0.5, 0.25, 1.0]
    np.testing.assert_allclose(seen(mitsuba, path), expected, atol=0.005)


def test_materials_are_shared_and_flat_where_they_emit(tmp_path: Path) -> None:
    smooth = replace(SQUARE, normals=np.tile([0.0, 0, 1], (4, 1)))
    parts = [Part("A", smooth, MATT), Part("B", smooth, MATT, radiance=(1.0, 1.0, 1.0))]
    write_scene(tmp_path / "lamp.xml", Lamp("lamp", tuple(parts)), parts, "test")
    root = ET.parse(tmp_path / "lamp.xml").getroot()
    assert len(root.findall("bsdf")) == 1
    flags = [shape.find("boolean[@name='face_normals']") for shape in root.findall("shape")]
    assert flags[0] is None
    assert flags[1] is not None
    assert b"property float nx" in (tmp_path / "meshes" / "A.ply").read_bytes()
    assert b"property float nx" not in (tmp_path / "meshes" / "B.ply").read_bytes()


@pytest.mark.parametrize("names", [("Glass", "Led"), ("Led", "Glass"), ("glass", "Glass_bsdf")])
def test_parts_may_be_called_as_materials_are(names: tuple[str, str], tmp_path: Path) -> None:
    """Mitsuba takes each identifier once, whichever part is written first."""
    parts = [Part(name, SQUARE, replace(GLASS)) for name in names]
    write_scene(tmp_path / "lamp.xml", Lamp("lamp", tuple(parts)), parts, "test")
    root = ET.parse(tmp_path / "lamp.xml").getroot()
    identifiers = [element.get("id", "").lower() for element in root]
    assert len(set(identifiers)) == len(identifiers) == 4
