"""USD stages that reference lamps, imported by Blender's own importer."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from purelight_format.bundle import Bundle
from purelight_format.members.finishes import Finish
from purelight_format.usd import asset_layer
from tests.support import blender_lamps
from tests.support.analytic_lamps import CENTRE, COLOUR, RADIUS, Lamp, ball
from tests.support.blender_host import Blender
from tests.unit.blender.conftest import pixels

STAGE = """#usda 1.0
(
    upAxis = "Y"
    metersPerUnit = 0.01
)
def Xform "World"
{
    def "Pendant" ( prepend references = @./lamp.usda@ )
    {
        double3 xformOp:translate = (0, 120, 50)
        float3 xformOp:rotateXYZ = (-90, 0, 0)
        float3 xformOp:scale = (100, 100, 100)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]
        float purelight:dimmer = 0.5
    }
    def "Instanced" (
        prepend references = @./lamp.usda@
        instanceable = true
    )
    {
        double3 xformOp:translate = (100, 120, 50)
        float3 xformOp:scale = (100, 100, 100)
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]
    }
    def "Squeezed" ( prepend references = @./lamp.usda@ )
    {
        float3 xformOp:scale = (100, 50, 100)
        uniform token[] xformOpOrder = ["xformOp:scale"]
    }
    def Cube "Box"
    {
        double size = 40
    }
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("stage")
    path = blender_lamps.glass_ball().write(made / "lamp.plux")
    write_layer(path)
    (made / "room.usda").write_text(STAGE)
    return made


def write_layer(path: Path, digest: str = "") -> None:
    bundle = Bundle.open(path)
    paths = asset_layer.Paths("./lamp.plux", "./lamp.usda", digest or bundle.digest)
    text = asset_layer.layer_text(bundle.manifest, bundle.surface(), paths)
    path.with_name("lamp.usda").write_text(text)


def painted(paint: tuple[float, float, float]) -> Lamp:
    """A ball with a finish, so that its likeness is shown where no bundle is read."""
    lamp = ball(0.0)
    sides = np.zeros((len(lamp.surface.triangles), 2), np.uint8)
    surface = replace(lamp.surface, finish=sides)
    return replace(lamp, surface=surface, finishes=(Finish("paint", paint),))


def by_name(things: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    return {thing["name"]: thing for thing in things}


def test_lamps_stand_where_the_stage_has_them(blender: Blender, folder: Path) -> None:
    """On a stage of centimetres with Y up; the lamp that is squeezed keeps its stand-in."""
    _, said, things, counts = blender.run(
        ("empty", {}), ("usd", {"path": str(folder / "room.usda")}), ("objects", {}),
        ("counts", {}),
    )  # fmt: skip
    assert said == ["FINISHED"]
    lamps = [thing for thing in things if thing["dimmer"] is not None and thing["type"] == "MESH"]
    assert len(lamps) == 2
    assert counts["meshes"] == 2  # One lamp, one box.
    named = by_name(things)
    hung = next(thing for thing in lamps if thing["parent"] == "Pendant")
    expected = [[1, 0, 0, 0], [0, 1, 0, -0.5], [0, 0, 1, 1.2], [0, 0, 0, 1]]
    assert np.allclose(hung["world"], expected, atol=1e-5)
    assert hung["dimmer"] == 0.5
    inner = next(thing for thing in lamps if thing["parent"] is None)
    assert np.allclose(inner["world"], np.eye(4), atol=1e-5)
    assert inner["dimmer"] == named["Instanced"]["dimmer"] == 1
    assert np.allclose(hung["size"], 2 * RADIUS, rtol=0.02)
    lights = [thing for thing in things if thing["type"] == "LIGHT"]
    assert [thing["parent"] for thing in lights] == ["Squeezed"]
    told = [line for line in blender.said() if line.startswith("PureLight: /World/Squeezed")]
    assert len(told) == 1
    assert told[0].endswith("its stand-in light is kept")


def test_a_lamp_asset_by_itself_is_a_lamp(blender: Blender, folder: Path) -> None:
    _, _, things = blender.run(
        ("empty", {}), ("usd", {"path": str(folder / "lamp.usda")}), ("objects", {})
    )
    assert [thing["type"] for thing in things if thing["dimmer"] is not None] == ["MESH"]
    assert not [thing for thing in things if thing["type"] == "LIGHT"]


def test_who_lacks_the_extension_sees_the_lamp_in_its_materials(
    blender: Blender, tmp_path: Path
) -> None:
    """A matt ball under a white sky shows its paint, though its light stands inside of it."""
    paint = (0.7, 0.5, 0.2)
    write_layer(painted(paint).write(tmp_path / "lamp.plux"))
    camera = np.eye(4)
    camera[:3, 3] = np.add(CENTRE, (0, 0, 4))
    wish = {"camera": camera.tolist(), "size": 0.6 * RADIUS, "pixels": 8, "samples": 64,
            "osl": False, "bounces": 2, "path": str(tmp_path / "seen.exr")}  # fmt: skip
    _, _, things, _ = blender.run(
        ("empty", {"background": 1.0, "ours": False}),
        ("usd", {"path": str(tmp_path / "lamp.usda")}),
        ("objects", {}), ("picture", wish), installed=False,
    )  # fmt: skip
    assert sorted(t["type"] for t in things if t["type"] != "EMPTY") == ["LIGHT", "MESH"]
    assert all(thing["dimmer"] is None for thing in things if thing["type"] == "MESH")
    seen = pixels(tmp_path / "seen.exr").mean((0, 1))
    np.testing.assert_allclose(seen, paint, atol=0.06)  # And a little gloss.


@pytest.mark.parametrize("fault", ["missing", "damaged", "another"])
def test_a_bundle_at_fault_leaves_its_stand_in(
    fault: str, blender: Blender, tmp_path: Path
) -> None:
    path = blender_lamps.glass_ball().write(tmp_path / "lamp.plux")
    write_layer(path, "0" * 64 if fault == "another" else "")
    if fault == "missing":
        path.unlink()
    elif fault == "damaged":
        path.write_bytes(path.read_bytes()[:-100])
    _, said, things = blender.run(
        ("empty", {}), ("usd", {"path": str(tmp_path / "lamp.usda")}), ("objects", {})
    )
    assert said == ["FINISHED"]
    assert [thing["type"] for thing in things if thing["type"] != "EMPTY"] == ["LIGHT"]
    words = {"missing": "cannot be found", "damaged": "PLX_ZIP", "another": "not the bundle"}
    (told,) = (line for line in blender.said() if line.startswith("PureLight: "))
    assert words[fault] in told
    assert told.endswith("its stand-in light is kept")


def test_stages_without_lamps_are_none_of_our_business(blender: Blender, tmp_path: Path) -> None:
    text = '#usda 1.0\ndef Cube "Box"\n{\n}\n'
    (tmp_path / "box.usda").write_text(text)
    _, said, things = blender.run(
        ("empty", {}), ("usd", {"path": str(tmp_path / "box.usda")}), ("objects", {})
    )
    assert said == ["FINISHED"]
    assert [thing["type"] for thing in things] == ["MESH"]
    assert not [line for line in blender.said() if "PureLight" in line]


def test_a_lamps_likeness_is_not_left_around_it(blender: Blender, tmp_path: Path) -> None:
    """The mesh of its materials, which are for those who cannot read the bundle."""
    write_layer(painted((0.7, 0.5, 0.2)).write(tmp_path / "lamp.plux"))
    (tmp_path / "room.usda").write_text(ROOM.format(more="        instanceable = true\n"))
    camera = np.eye(4)
    camera[:3, 3] = np.add(CENTRE, (0, 0, 4))
    seen = {"camera": camera.tolist(), "size": 0.6 * RADIUS, "pixels": 4}
    for name in ("lamp.usda", "room.usda"):
        path = tmp_path / f"{name}.exr"
        _, _, things, _ = blender.run(
            ("empty", {}), ("usd", {"path": str(tmp_path / name)}), ("objects", {}),
            ("picture", seen | {"path": str(path)}),
        )  # fmt: skip
        assert [thing["type"] for thing in things if thing["type"] != "EMPTY"] == ["MESH"]
        np.testing.assert_allclose(pixels(path), np.broadcast_to(COLOUR, (4, 4, 3)), rtol=1e-3)


ROOM = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 1
)
def Xform "World"
{{
    def "Lamp" (
        prepend references = @./lamp.usda@
{more}    )
    {{
    }}
}}
"""
CLUSTERS = """#usda 1.0
(
    upAxis = "Z"
    metersPerUnit = 1
)
class "Cluster"
{
    def "Single" (
        prepend references = @./lamp.usda@
    )
    {
        float purelight:dimmer = 0.125
    }
    def "Shared" (
        prepend references = @./lamp.usda@
        instanceable = true
    )
    {
        float purelight:dimmer = 0.25
    }
}
def Xform "World"
{
    def Xform "One" (
        inherits = </Cluster>
        instanceable = true
    )
    {
    }
    def Xform "Two" (
        inherits = </Cluster>
        instanceable = true
    )
    {
    }
    def PointInstancer "Many"
    {
        rel prototypes = </World/Many/Prototypes/Lamp>
        int[] protoIndices = [0, 0]
        point3f[] positions = [(0, 0, 0), (2, 0, 0)]
        def Scope "Prototypes"
        {
            def "Lamp" (
                prepend references = @./lamp.usda@
            )
            {
                float purelight:dimmer = 0.5
            }
        }
    }
}
"""


def test_lamps_in_instances_and_prototypes_take_the_place_of_their_stand_ins(
    blender: Blender, folder: Path
) -> None:
    (folder / "clusters.usda").write_text(CLUSTERS)
    _, _, things, _ = blender.run(
        ("empty", {}), ("usd", {"path": str(folder / "clusters.usda")}), ("objects", {}),
        ("counts", {}),
    )  # fmt: skip
    assert not [thing for thing in things if thing["type"] == "LIGHT"]
    dimmers = [thing["dimmer"] for thing in things if thing["type"] == "MESH"]
    assert sorted(dimmers) == [0.125, 0.5, 1.0]
    told = [line for line in blender.said() if line.startswith("PureLight: ")]
    assert told == ["PureLight: /World/One/Shared: its dimmer, of an instance in an instance, "
                    "counts as 1"]  # fmt: skip
