"""Which parts emit, how much, and to which side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from purelight_format.color import lumens
from purelight_format.errors import PureLightError
from purelight_import.importing import lamp_lit
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.mesh import Mesh
from purelight_import.model.picture import Picture
from purelight_import.options import Options
from purelight_import.parts.emitters import Choice, flux, parse
from purelight_import.parts.room_parts import room_lines
from tests.support.lamp_files import glb, model


def mesh(made: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(made.vertices), np.array(made.faces, np.uint32))


def part(name: str, made: trimesh.Trimesh, **more: Any) -> Part:
    return Part(name, mesh(made), Material(f"{name} paint"), (f"{name} node",), **more)


def sheet(z: float, size: float = 0.1) -> trimesh.Trimesh:
    """A square that faces up."""
    half = size / 2
    corners = [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False)


def lamp(*parts: Part) -> Lamp:
    return Lamp("lamp", parts)


def given(found: Lamp) -> dict[str, float]:
    """Lumens by part."""
    return {p.name: lumens(flux(p, p.radiance)) for p in found.parts if p.radiance is not None}


TWO = (
    part("LED_1", model.ball(0.01), radiance=(1.0, 1.0, 1.0)),
    part("LED_2", model.ball(0.02), radiance=(1.0, 1.0, 1.0)),
    part("Shade", model.ball(0.1)),
)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("bulb", Choice("bulb")),
        ("bulb=806lm", Choice("bulb", 806)),
        ("a=b*=0.8klm,2700K", Choice("a=b*", 800, 2700)),
        ("bulb=3000 K", Choice("bulb", None, 3000)),
        ("bulb=2W", Choice("bulb", 1366)),
    ],
)
def test_the_grammar(text: str, expected: Choice) -> None:
    assert parse(text) == expected


@pytest.mark.parametrize(
    "text", ["bulb=", "bulb=806", "bulb=-1lm", "=5lm", "bulb=806lm;2700K", "bulb=1K", "bulb=0lm"]
)
def test_what_is_no_emitter(text: str) -> None:
    with pytest.raises(ValueError):
        parse(text)


@pytest.mark.parametrize("name", ["LED_2", "led_?", "*", "LED_2 node", "led_2 PAINT", "emissive"])
def test_names_of_parts_nodes_and_materials(name: str) -> None:
    found = lamp_lit(lamp(*TWO), Options(emitters=(f"{name}=100lm",)))
    assert "LED_2" in given(found)
    assert sum(given(found).values()) == pytest.approx(100)


def test_a_name_that_all_parts_share_is_first_that_of_a_part() -> None:
    """A shop's file: root `lamp`, and of its parts one of the material `lamp`."""
    bulb, arm = part("Mesh_1", model.ball(0.01)), part("Mesh_2", model.ball(0.02))
    bulb = replace(bulb, path=("lamp", "Mesh_1"), material=Material("lamp"))
    arm = replace(arm, path=("lamp", "Mesh_2"), material=Material("White"))
    found = lamp_lit(lamp(bulb, arm), Options(emitters=("lamp=100lm",)))
    assert given(found) == pytest.approx({"Mesh_1": 100})
    arm_only = replace(bulb, material=Material("Black"))
    both = lamp_lit(lamp(arm_only, arm), Options(emitters=("Lamp=100lm",)))
    assert sorted(given(both)) == ["Mesh_1", "Mesh_2"]  # the root alone is called so


def test_lumens_are_shared_by_what_has_none() -> None:
    found = lamp_lit(lamp(*TWO), Options(emitters=("LED_1=30lm", "LED_2", "Shade"), lumens=100))
    assert given(found)["LED_1"] == pytest.approx(30)
    assert sum(given(found).values()) == pytest.approx(100)
    assert given(found)["Shade"] == pytest.approx(25 * given(found)["LED_2"])  # by area
    whole = lamp_lit(lamp(*TWO), Options(emitters=("LED_1=30lm", "LED_2=10lm"), lumens=100))
    assert given(whole) == pytest.approx({"LED_1": 75, "LED_2": 25})


def test_lumens_that_leave_nothing() -> None:
    with pytest.raises(PureLightError, match="leaves nothing"):
        lamp_lit(lamp(*TWO), Options(emitters=("LED_1=30lm", "LED_2"), lumens=30))


def test_temperatures_change_the_colour_alone() -> None:
    options = Options(emitters=("LED_1=30lm,2700K", "LED_2=30lm"), kelvin=6500)
    found = {p.name: p.radiance for p in lamp_lit(lamp(*TWO), options).parts}
    warm, cold = (np.array(found[name]) for name in ("LED_1", "LED_2"))
    assert warm[2] / warm[0] < 0.3 < 0.8 < cold[2] / cold[0]
    assert given(lamp_lit(lamp(*TWO), options)) == pytest.approx({"LED_1": 30, "LED_2": 30})


def test_what_emits_by_the_file_but_is_not_chosen_is_told() -> None:
    found = lamp_lit(lamp(*TWO), Options(emitters=("LED_1",)))
    assert list(given(found)) == ["LED_1"]
    assert any("stay dark" in line and "LED_2" in line for line in found.notes.lines())


def test_nothing_that_emits_names_what_might() -> None:
    dark = lamp(part("Foot", model.ball(0.1)), part("Bulb", model.ball(0.02)))
    with pytest.raises(PureLightError, match=r"--emitter 'Bulb=806lm'.*Foot"):
        lamp_lit(dark, Options())
    with pytest.raises(PureLightError, match=r"Shade: no part.*Foot"):
        lamp_lit(dark, Options(emitters=("Shade",)))


def test_textured_light_counts_where_it_lies() -> None:
    """Half of the square is lit: the right one, or the upper one, of the picture."""
    square = mesh(sheet(0, 2))
    uv = np.array([[0.0, 0], [0.5, 0], [0.5, 1], [0, 1]])  # the left half of the picture
    for columns, expected in (((1, 0), 1.0), ((0, 1), 0.0), ((1, 1), 1.0)):
        pixels = np.tile(np.array(columns, np.float32)[None, :, None], (2, 1, 3))
        lit = Part("Lit", replace(square, uv=uv), Material(), radiance=Picture("p", pixels))
        assert lumens(flux(lit, lit.radiance)) == pytest.approx(683 * 4 * np.pi * expected)


def turned(made: trimesh.Trimesh) -> trimesh.Trimesh:
    copy = made.copy()
    copy.invert()
    return copy


def test_a_part_under_the_black_of_a_picture_stays_dark() -> None:
    """One material for the whole lamp, whose picture of light shines on one part alone: the others
    are no emitters, and have no second side."""
    pixels = np.zeros((1, 4, 3), np.float32)
    pixels[0, 3] = 1.0
    glow = Picture("p", pixels)
    parts = [
        replace(part(name, sheet(z)), radiance=glow, double_sided=True)
        for z, name in enumerate(("Lit", "Dark"))
    ]
    left = [np.full((4, 2), u) for u in (0.9, 0.3)]
    lit, dark = (replace(p, mesh=replace(p.mesh, uv=uv)) for p, uv in zip(parts, left, strict=True))
    found = lamp_lit(lamp(lit, dark), Options(lumens=100.0))
    assert list(given(found)) == ["Lit", "Lit_back"]
    assert sum(given(found).values()) == pytest.approx(100)
    assert [p.name for p in found.parts].count("Dark") == 1
    assert "black (Dark)" in found.notes.lines()[-1]
    none = lamp_lit(lamp(dark), Options())
    assert sum(given(none).values()) == 0
    with pytest.raises(PureLightError, match="black"):
        lamp_lit(lamp(dark), Options(lumens=100.0))


def test_bodies_that_shone_inwards_are_turned() -> None:
    glow = (1.0, 1.0, 1.0)
    for made in (model.ball(0.02), turned(model.ball(0.02))):
        (found,) = lamp_lit(lamp(part("Bulb", made, radiance=glow)), Options()).parts
        outward = np.einsum("td,td->t", found.mesh.cross, found.mesh.corners.mean(1))
        assert (outward > 0).all()


def test_an_open_bulb_shines_outwards() -> None:
    half = model.ball(0.02)
    half.update_faces(half.triangles_center[:, 2] < 0.012)
    for made in (half, turned(half)):
        bulb = part("Bulb", made, radiance=(1.0,) * 3, double_sided=True)
        (found,) = lamp_lit(lamp(bulb), Options()).parts
        outward = np.einsum("td,td->t", found.mesh.cross, found.mesh.corners.mean(1))
        assert (outward > 0).all()


def test_a_panel_shines_from_the_side_that_is_not_covered() -> None:
    housing = part("Housing", model.box((0.2, 0.2, 0.02), (0, 0, 0.0101)))
    for made in (sheet(0), turned(sheet(0))):
        panel = part("Panel", made, radiance=(1.0,) * 3, double_sided=True)
        lit = lamp_lit(lamp(panel, housing), Options())
        (found,) = (p for p in lit.parts if p.radiance is not None)
        assert (found.mesh.cross[:, 2] < 0).all()


def test_a_sheet_of_one_side_is_turned_to_the_open() -> None:
    can = trimesh.creation.cylinder(radius=0.06, height=0.2)
    can.update_faces(can.triangles_center[:, 2] > -0.09)  # open below
    panel = part("Panel", sheet(-0.08), radiance=(1.0,) * 3)
    found = lamp_lit(lamp(panel, part("Can", can)), Options())
    assert (found.parts[0].mesh.cross[:, 2] < 0).all()
    assert any("turned" in line for line in found.notes.lines())


@pytest.mark.parametrize(
    "options", [Options(emitters=("Panel=800lm",)), Options(lumens=800), Options()]
)
def test_lumens_are_those_of_both_sides(options: Options) -> None:
    panel = part("Panel", sheet(0), radiance=(1.0,) * 3, double_sided=True)
    found = given(lamp_lit(lamp(panel), options))
    total = 800 if options.lumens or options.emitters else 683 * 2 * np.pi * panel.mesh.area
    assert found == pytest.approx({"Panel": total / 2, "Panel_back": total / 2}, rel=1e-3)


def test_lumens_are_shared_by_the_sides_that_shine() -> None:
    """A sheet that shines to both sides gets as much as two that shine to one."""
    both = part("Both", sheet(0), radiance=(1.0,) * 3, double_sided=True)
    bulb = part("Bulb", model.ball(0.02), radiance=(1.0,) * 3)
    found = given(lamp_lit(lamp(both, bulb), Options(lumens=100)))
    assert found["Both"] == pytest.approx(found["Both_back"])
    ratio = both.mesh.area / bulb.mesh.area
    assert found["Both"] == pytest.approx(ratio * found["Bulb"], rel=1e-3)
    assert sum(found.values()) == pytest.approx(100)


@pytest.mark.parametrize("size", [1, 2, 4])
def test_what_is_not_there_emits_nothing(size: int) -> None:
    """A quarter of the sheet is there; a picture of its light is brighter in that quarter."""
    square, uv = mesh(sheet(0)), np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    there = np.zeros((4, 4, 1), np.float32)
    there[:2, :2] = 1
    lies = {"mesh": replace(square, uv=uv), "material": Material(opacity=Picture("a", there))}
    bright = np.ones((size, size, 3), np.float32)
    bright[: size // 2, : size // 2] = 3
    for radiance, level in (((1.0,) * 3, 1), (Picture("p", bright), 1 if size == 1 else 3)):
        sign = replace(part("Sign", sheet(0), radiance=radiance), **lies)
        found = given(lamp_lit(lamp(sign), Options()))
        expected = 683 * np.pi * square.area * level / 4
        assert found["Sign"] == pytest.approx(expected, rel=0.03)


def test_alpha_that_lies_otherwise_dims_by_its_mean() -> None:
    half = np.array([[[1.0], [0.0]]], np.float32)
    turned = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])
    alpha = Picture("a", half, to_uv=turned)
    glow = Picture("p", np.ones((2, 2, 3), np.float32))
    sign = replace(part("Sign", sheet(0), radiance=glow), material=Material(opacity=alpha))
    found = lamp_lit(lamp(sign), Options())
    assert given(found)["Sign"] == pytest.approx(683 * np.pi * sign.mesh.area / 2)
    assert any("mean of its alpha" in line for line in found.notes.lines())


def test_floors_and_cables_are_noticed() -> None:
    bulb, foot = (
        part("Bulb", model.ball(0.05)),
        part("Foot", model.box((0.1, 0.1, 0.1), (0, 0, -0.1))),
    )
    floor = part("Plane", sheet(-0.15, 3.0))
    cable = part("Rope", model.box((0.01, 0.01, 1.5), (0, 0, 0.8)))
    assert room_lines(lamp(bulb, foot)) == []
    (line,) = room_lines(lamp(bulb, foot, floor))
    assert "--omit 'Plane'" in line
    (line,) = room_lines(lamp(bulb, foot, cable))
    assert "'Rope' (a long cable" in line


def test_lumens_reach_the_written_scene(tmp_path: Path, mitsuba: Any) -> None:
    """Light traced out of the written file, not what the table says of it."""
    from purelight_import import import_lamp
    from purelight_import.sanity.light import leaving
    from purelight_import.sanity.subject import Subject

    options = Options(emitters=("Bulb=806lm,2700K",))
    made = import_lamp(glb.write(tmp_path, model.lamp()), tmp_path / "out", options, picture=False)
    subject = Subject(mitsuba.load_file(str(made.scene), optimize=False))
    assert lumens(leaving(subject).emitted.sum(0)) == pytest.approx(806, rel=0.01)
