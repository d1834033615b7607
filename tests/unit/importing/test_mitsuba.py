"""Mitsuba's scenes, of today and of old."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from purelight_import.formats import is_mitsuba_3, read
from purelight_import.importing import import_lamp
from purelight_import.model.lamp import Lamp
from purelight_import.model.material import Verbatim
from purelight_import.options import Options
from purelight_mitsuba import use
from tests.support.lamp_files import mitsuba as writers
from tests.support.lamp_files import model

GLOW = '<emitter type="area"><rgb name="radiance" value="1"/></emitter>'


def scene(folder: Path, body: str, version: str = "3.0.0") -> Path:
    path = folder / "shelf.xml"
    path.write_text(f'<scene version="{version}">{body}</scene>')
    return path


def lamp(folder: Path, body: str, version: str = "3.0.0") -> Lamp:
    return read(scene(folder, body, version))


OLD = """
  <default name="rough" value="0.25"/>
  <integrator type="photonmapper"><integer name="maxDepth" value="3"/></integrator>
  <sensor type="perspective"><transform name="toWorld">
    <lookAt origin="0, -3, 0" target="0, 0, 0" up="0, 0, 1"/></transform>
    <film type="hdrfilm"><rfilter type="gaussian"/></film></sensor>
  <emitter type="envmap"><string name="filename" value="not/there.exr"/></emitter>
  <bsdf type="roughdielectric" id="frost"><string name="intIOR" value="bk7"/>
    <float name="alpha" value="$rough"/></bsdf>
  <bsdf type="phong" id="paint"><srgb name="diffuseReflectance" value="#ff0000"/>
    <float name="exponent" value="198"/></bsdf>
  <bsdf type="coating" id="coated"><bsdf type="conductor"/></bsdf>
  <bsdf type="mixturebsdf" id="mixed"><string name="weights" value="1, 3"/>
    <bsdf type="diffuse"/><bsdf type="roughplastic"/></bsdf>
  <bsdf type="difftrans" id="paper"><spectrum name="transmittance" value="0.5"/></bsdf>
  <shape type="sphere" id="bulb"><float name="radius" value="0.1"/>
    <emitter type="area"><blackbody name="radiance" temperature="3000K"/></emitter></shape>
  <shape type="cube" id="glass"><transform name="toWorld"><scale value="0.2"/></transform>
    <ref id="frost"/></shape>
  <shape type="rectangle" id="panel"><ref id="paint"/></shape>
  <shape type="disk" id="lid"><ref id="coated"/></shape>
  <shape type="cylinder" id="rod"><float name="radius" value="0.05"/><ref id="mixed"/></shape>
  <shape type="rectangle" id="shade"><ref id="paper"/></shape>
"""


@pytest.mark.usefixtures("at_once")
def test_an_old_scene_in_the_words_of_today(mitsuba: Any, tmp_path: Path) -> None:
    path = scene(tmp_path, OLD, "0.5.0")
    made = import_lamp(path, tmp_path / "out", Options(units="m", lumens=800), picture=False)
    text = made.scene.read_text()
    parts = {row["name"]: row for row in made.parts}
    assert set(parts) == {"bulb", "glass", "panel", "lid", "rod", "shade"}
    for word in ('id="frost"', 'type="roughplastic" id="paint"', 'type="blendbsdf" id="mixed"',
                 '<float name="weight" value="0.75"', 'type="principledthin" id="paper"',
                 '<float name="alpha" value="0.1"', 'type="conductor" id="coated"',
                 '<float name="alpha" value="0.25"'):  # fmt: skip
        assert word in text, word
    r, g, b = parts["bulb"]["radiance"]
    assert r > 1.5 * g > 3 * b > 0
    notes = "\n".join(made.notes)
    for word in ("clear coats", "phong", "difftrans", "black bodies", "infinity"):
        assert word in notes
    assert "--up" not in notes  # the camera says it


@pytest.mark.usefixtures("at_once")
def test_up_is_y_where_no_camera_says_it(mitsuba: Any, tmp_path: Path) -> None:
    body = f'<shape type="cylinder">{GLOW}</shape>'
    found = lamp(tmp_path, body, "0.6.0")
    assert (found.frame.up, found.frame.up_known, found.frame.unit_known) == ("y", False, False)
    assert lamp(tmp_path, body).frame.unit_known


@pytest.mark.usefixtures("at_once")
def test_analytic_shapes_keep_their_side_and_size(mitsuba: Any, tmp_path: Path) -> None:
    turn = '<transform name="to_world"><scale value="2"/><translate z="1"/></transform>'
    body = (
        f'<shape type="sphere" id="a"><boolean name="flip_normals" value="true"/>{turn}</shape>'
        f'<shape type="disk" id="b">{turn}{GLOW}</shape>'
        f'<shape type="rectangle" id="c"><boolean name="flip_normals" value="true"/>{turn}</shape>'
    )
    a, b, c = (part.mesh for part in lamp(tmp_path, body).parts)
    assert a.area == pytest.approx(16 * np.pi, rel=1e-3)
    inward = np.einsum("td,td->t", a.cross, a.corners.mean(1) - [0, 0, 1])
    assert (inward < 0).all()
    assert b.area == pytest.approx(4 * np.pi, rel=1e-3)
    assert (b.cross[:, 2] > 0).all()
    assert (c.cross[:, 2] < 0).all()


@pytest.mark.usefixtures("at_once")
def test_instances_are_copies(mitsuba: Any, tmp_path: Path) -> None:
    body = (
        '<shape type="shapegroup" id="led"><shape type="cube"><transform name="to_world">'
        '<scale value="0.1"/></transform></shape></shape>'
        + "".join(
            f'<shape type="instance"><ref id="led"/><transform name="to_world">'
            f'<translate x="{x}"/></transform></shape>'
            for x in (0, 3)
        )
        + f'<shape type="sphere">{GLOW}</shape>'
    )
    centres = [p.mesh.bounds.mean(0)[0] for p in lamp(tmp_path, body).parts]
    np.testing.assert_allclose(centres, [0, 3, 0], atol=1e-6)


@pytest.mark.usefixtures("at_once")
def test_includes_and_textures_come_along(mitsuba: Any, tmp_path: Path) -> None:
    from PIL import Image

    (tmp_path / "parts").mkdir()
    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "parts" / "red.png")
    inner = (
        '<scene version="3.0.0"><bsdf type="diffuse" id="red"><texture type="bitmap" '
        'name="reflectance"><string name="filename" value="red.png"/></texture></bsdf></scene>'
    )
    (tmp_path / "parts" / "red.xml").write_text(inner)
    body = (
        f'<include filename="parts/red.xml"/><shape type="cube" id="box"><ref id="red"/></shape>'
        f'<shape type="sphere"><transform name="to_world"><translate z="4"/></transform>{GLOW}'
        "</shape>"
    )
    made = import_lamp(scene(tmp_path, body), tmp_path / "out", picture=False)
    assert 'value="textures/red.png"' in made.scene.read_text()
    assert (tmp_path / "out" / "textures" / "red.png").is_file()
    assert mitsuba.load_file(str(made.scene))


@pytest.mark.usefixtures("at_once")
def test_point_lights_become_spheres(mitsuba: Any, tmp_path: Path) -> None:
    body = (
        '<emitter type="point"><rgb name="intensity" value="3,2,1"/>'
        '<point name="position" x="0" y="0" z="0.5"/></emitter><shape type="cube"/>'
    )
    made = import_lamp(scene(tmp_path, body), tmp_path / "out", picture=False)
    (row,) = [r for r in made.parts if "lumens" in r]
    np.testing.assert_allclose(row["center"], [0, 0, 0.5], atol=1e-6)
    assert row["lumens"] == pytest.approx(
        4 * np.pi * 683 * (0.2126 * 3 + 0.7152 * 2 + 0.0722), rel=1e-3
    )


def test_which_scenes_need_no_import(tmp_path: Path) -> None:
    assert is_mitsuba_3(scene(tmp_path, "", "3.5.0"))
    assert not is_mitsuba_3(scene(tmp_path, "", "0.6.0"))
    assert not is_mitsuba_3(tmp_path / "lamp.glb")


FAULTS = {
    "doctype": ('<!DOCTYPE a [<!ENTITY b "c">]><scene version="3.0.0"/>', "document type"),
    "no_xml": ("certainly not", "no XML"),
    "other": ("<html/>", "no Mitsuba scene"),
    "versionless": ("<scene/>", "no version"),
    "dangling": ('<scene version="3.0.0"><shape type="cube"><ref id="x"/></shape></scene>', "'x'"),
    "circle": (
        '<scene version="3.0.0"><bsdf type="twosided" id="a"><ref id="a"/></bsdf>'
        '<shape type="cube"><ref id="a"/></shape></scene>', "circles",
    ),
    "recursion": ('<scene version="3.0.0"><include filename="broken.xml"/></scene>', "each other"),
    "plugin": ('<scene version="3.0.0"><shape type="teapot"/></scene>', "teapot"),
    "outside": (
        '<scene version="3.0.0"><shape type="ply"><string name="filename" value="/etc/hostname"/>'
        "</shape></scene>", "outside",
    ),
    "empty": ('<scene version="3.0.0"/>', "no mesh"),
}  # fmt: skip


def test_a_crash_of_mitsuba_is_no_crash_of_ours(tmp_path: Path, fault: Any) -> None:
    blend = '<shape type="cube"><bsdf type="blendbsdf"/></shape>'
    assert "sudden end" in fault(scene(tmp_path, blend))


@pytest.mark.usefixtures("at_once")
@pytest.mark.parametrize("name", FAULTS)
def test_faulty_scenes(name: str, tmp_path: Path, fault: Any) -> None:
    text, reason = FAULTS[name]
    path = tmp_path / "broken.xml"
    path.write_text(text)
    assert reason in fault(path, "--emitter", "*=1lm")


@pytest.mark.usefixtures("at_once")
def test_a_mesh_that_claims_too_much(tmp_path: Path, fault: Any) -> None:
    path = writers.write(tmp_path, model.lamp())
    head = (
        (tmp_path / "Base.ply")
        .read_bytes()
        .replace(b"element vertex 8", b"element vertex 3000000000")
    )
    (tmp_path / "Base.ply").write_bytes(head)
    assert "3000000000" in fault(path)


@pytest.mark.usefixtures("at_once")
def test_materials_are_kept_as_they_are_written(mitsuba: Any, tmp_path: Path) -> None:
    found = read(writers.write(tmp_path, model.lamp()))
    materials = {p.name: p.material for p in found.parts}
    assert all(isinstance(m, Verbatim) for m in materials.values())
    assert 'type="dielectric"' in materials["Globe"].elements[0]  # type: ignore[union-attr]
    assert materials["Globe"].glass


MILKY = """
  <shape type="sphere" id="glass"><float name="radius" value="5"/><bsdf type="dielectric"/>
    <medium type="homogeneous" name="interior"><float name="scale" value="2"/>
      <rgb name="{sigma}" value="0.2,0.5,1"/><rgb name="albedo" value="0"/></medium></shape>
  <shape type="sphere" id="bulb"><point name="center" x="12" y="0" z="0"/>
    <emitter type="area"><rgb name="radiance" value="1"/></emitter></shape>"""


@pytest.mark.parametrize(
    ("version", "units", "scale"),
    [("3.0.0", None, 2), ("3.0.0", "cm", 200), ("0.5.0", None, 200), ("0.5.0", "mm", 2000)],
)
def test_media_are_as_dense_in_metres(
    version: str, units: str | None, scale: float, tmp_path: Path
) -> None:
    sigma = "sigma_t" if version == "3.0.0" else "sigmaT"
    path = scene(tmp_path, MILKY.format(sigma=sigma), version)
    written = import_lamp(path, tmp_path / "out", Options(units=units), picture=False).scene
    media = list(ET.parse(written).iter("medium"))
    scales = [float(e.get("value", "")) for m in media for e in m if e.get("name") == "scale"]
    assert scales == pytest.approx([scale])


def test_grids_of_media_lie_where_they_were(tmp_path: Path) -> None:
    """In centimetres, with Y up."""
    mi = use()
    grid = np.zeros((2, 2, 2, 1), np.float32)
    grid[1] = 1  # along the file's Z
    mi.VolumeGrid(grid).write(str(tmp_path / "grid.vol"))
    cloud = MILKY.format(sigma="no").replace("homogeneous", "heterogeneous")
    start, end = cloud.index('<rgb name="no"'), cloud.index("</medium>")
    volume = """<volume type="gridvolume" name="sigma_t">
      <string name="filename" value="grid.vol"/><transform name="to_world">
      <scale value="10"/><translate x="-5" y="-5" z="-5"/></transform></volume>"""
    path = scene(tmp_path, cloud[:start] + volume + cloud[end:])
    made = import_lamp(path, tmp_path / "out", Options(units="cm", up="y"), picture=False)
    medium = next(
        s.interior_medium() for s in mi.load_file(str(made.scene)).shapes()
        if s.interior_medium() is not None
    )  # fmt: skip
    place = dr.zeros(mi.MediumInteraction3f, 3)
    place.p = mi.Point3f([0.0] * 3, [-0.04, 0.04, -0.0125], [0.0] * 3)  # the file's Z is now -Y
    sigma_t = np.array(medium.get_scattering_coefficients(place)[2])[0]
    np.testing.assert_allclose(sigma_t, [200, 0, 150], atol=1e-2)
