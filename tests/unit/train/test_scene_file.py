"""Light of spheres that stand in any way is that of upright ones; cylinders are not mirrored."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_train.light.luminaire import scene_triangles
from purelight_train.truth.plane import Plane
from tests.support import fidelity

TURNS = {
    "upright": "",
    "turned": '<rotate x="0.6" y="0.8" angle="70"/>',
    "upside down": '<rotate x="1" angle="180"/>',
    # Mitsuba turns the normals of what is mirrored
    "mirrored and flipped": '<scale x="-1"/>',
}
SPHERE = """
  <shape type="sphere" id="lit">
    <transform name="to_world">{turn}<scale value="0.05"/><translate x="0.02" y="0.01"/></transform>
    <boolean name="flip_normals" value="{flip}"/>
    <emitter type="area">{radiance}</emitter>
  </shape>
  <shape type="sphere" id="base"><point name="center" x="0.3" y="0.01" z="0"/>
    <float name="radius" value="0.01"/><bsdf type="diffuse"/></shape>"""
ONE = '<rgb name="radiance" value="1"/>'
TEXTURE = (
    '<texture type="bitmap" name="radiance"><string name="filename" value="light.exr"/>'
    '<boolean name="raw" value="true"/></texture>'
)
PATHS = 1 << 18

pytestmark = pytest.mark.usefixtures("mitsuba")


def loaded(path: Path) -> Any:
    from purelight_train.light.luminaire import load_luminaire

    return load_luminaire(path, 0)


def scene(folder: Path, turn: str, radiance: str = ONE) -> Path:
    flip = "true" if "-1" in turn else "false"
    text = SPHERE.format(turn=turn, radiance=radiance, flip=flip)
    path = folder / "lamp.xml"
    path.write_text(f'<scene version="3.0.0">{text}\n</scene>')
    return path


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_a_sphere_lights_all_sides_alike(tmp_path: Path, turn: str) -> None:
    lamp = loaded(scene(tmp_path, turn))
    for height in (-1.0, 1.0):
        plane = Plane((0.02, 0.01, height), 0.2, 1)
        light, noise = fidelity.traced_plane(lamp.scene, plane, 8 * PATHS, 3)
        seen = np.pi * 0.05**2  # of a place so small and so far away, nearly
        assert noise.mean() < 0.02 * seen
        np.testing.assert_allclose(light.mean(), seen, rtol=0.05)


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_no_light_of_a_sphere_is_lost(tmp_path: Path, turn: str) -> None:
    lamp = loaded(scene(tmp_path, turn))
    flux = lamp.trace(PATHS, 1).flux
    np.testing.assert_allclose(np.array(flux), np.pi * 4 * np.pi * 0.05**2, rtol=0.01)


def test_a_turned_sphere_with_a_texture_is_refused(tmp_path: Path) -> None:
    image = mi.Bitmap(np.ones((4, 4, 3), np.float32))
    image.write(str(tmp_path / "light.exr"))
    loaded(scene(tmp_path, TURNS["upright"], TEXTURE))
    with pytest.raises(PureLightError, match="'lit' is a sphere that is turned"):
        loaded(scene(tmp_path, TURNS["turned"], TEXTURE))


def cylinder(folder: Path, turn: str) -> Path:
    path = scene(folder, turn)
    path.write_text(path.read_text().replace('"sphere" id="lit"', '"cylinder" id="lit"'))
    return path


def test_a_turned_cylinder_that_shines_is_taken(tmp_path: Path) -> None:
    assert loaded(cylinder(tmp_path, TURNS["turned"])).scene.emitters()


def test_a_mirrored_cylinder_that_shines_is_refused(tmp_path: Path) -> None:
    """It is seen to shine outwards, and drawn to shine inwards."""
    with pytest.raises(PureLightError, match="'lit' is a cylinder that is mirrored"):
        loaded(cylinder(tmp_path, TURNS["mirrored and flipped"]))


def test_a_picture_without_coordinates_is_refused(tmp_path: Path) -> None:
    """Mitsuba could not aim at it, nor then at any emitter of a process that holds it."""
    mi.Bitmap(np.ones((4, 4, 3), np.float32)).write(str(tmp_path / "light.exr"))
    mi.load_dict({"type": "cube"}).write_ply(str(tmp_path / "with.ply"))
    bare = mi.Mesh("bare", 3, 1)
    parameters = mi.traverse(bare)
    parameters["vertex_positions"], parameters["faces"] = [0, 0, 0, 1, 0, 0, 0, 1, 0], [0, 1, 2]
    parameters.update()
    bare.write_ply(str(tmp_path / "without.ply"))
    for name in ("with", "without"):
        (tmp_path / f"{name}.xml").write_text(
            f'<scene version="3.0.0"><shape type="ply" id="lit"><string name="filename" '
            f'value="{name}.ply"/><emitter type="area">{TEXTURE}</emitter></shape></scene>'
        )
    assert loaded(tmp_path / "with.xml").scene.emitters()
    with pytest.raises(PureLightError, match="'lit' shines by a texture"):
        loaded(tmp_path / "without.xml")


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("instance", "purelight-import makes a mesh of it"),
        ("bsplinecurve", "make it a mesh"),
        ("linearcurve", "make it a mesh"),
        ("sdfgrid", "make it a mesh"),
        ("ellipsoids", "make it a mesh"),
    ],
)
def test_shapes_without_triangles_are_refused(kind: str, reason: str, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "curve.txt", [[0, 0, k, 0.1] for k in range(5)])
    shape: dict[str, Any] = {"type": kind}
    scene: dict[str, Any] = {"type": "scene", "shape": shape}
    if kind == "instance":
        cubes = {"type": "shapegroup", "cube": {"type": "cube"}}
        scene = {
            "type": "scene",
            "group": cubes,
            "shape": shape | {"of": {"type": "ref", "id": "group"}},
        }
    elif kind == "sdfgrid":
        shape["grid"] = mi.TensorXf(np.indices((2, 2, 2)).sum(0)[..., None] - np.float32(1))
    elif kind == "ellipsoids":
        shape |= {"centers": mi.TensorXf(np.zeros((1, 3), np.float32)),
                  "scales": mi.TensorXf(np.ones((1, 3), np.float32)),
                  "quaternions": mi.TensorXf(np.array([[0, 0, 0, 1]], np.float32))}  # fmt: skip
    else:
        shape["filename"] = str(tmp_path / "curve.txt")
    with pytest.raises(PureLightError, match=f"{kind}.*{reason}"):
        scene_triangles(mi.load_dict(scene))


@pytest.mark.parametrize(
    ("attribute", "named"), [('id="coil"', "^shape 'coil'"), ("", "^a shape without id")]
)
def test_a_refused_shape_is_named(attribute: str, named: str, tmp_path: Path) -> None:
    np.savetxt(tmp_path / "curve.txt", [[0, 0, k, 0.1] for k in range(5)])
    (tmp_path / "lamp.xml").write_text(
        f'<scene version="3.0.0"><shape type="linearcurve" {attribute}><string name="filename" '
        'value="curve.txt"/><emitter type="area"><rgb name="radiance" value="1"/></emitter>'
        "</shape></scene>"
    )
    with pytest.raises(PureLightError, match=named):
        loaded(tmp_path / "lamp.xml")
