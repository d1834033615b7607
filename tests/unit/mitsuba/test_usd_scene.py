"""USD stages in Mitsuba: what is seen is where, and as bright, as UsdGeom and UsdLux say."""

from __future__ import annotations

import math
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba.cli import main
from purelight_mitsuba.usd_scene import load_usd
from purelight_onnx.picture import write_exr
from tests.support import analytic_lamps as lamps
from tests.support.usd_stages import CAMERA, LIGHT, first_hit, irradiance, loaded, stage


@pytest.mark.parametrize(
    ("kind", "values", "expected"),
    [
        ("SphereLight", "float inputs:radius = 0.5", math.pi * 0.25 / 4),
        ("SphereLight", "float inputs:radius = 0.5\n bool inputs:normalize = 1", 1 / 16),
        ("SphereLight", "float inputs:radius = 0.5\n float inputs:exposure = 3", math.pi / 2),
        ("DiskLight", "float inputs:radius = 0.5", math.pi * 0.25 / 4.25),
        ("DomeLight", "float inputs:intensity = 2", 2 * math.pi),
        ("DistantLight", "float inputs:intensity = 5\n bool inputs:normalize = 1", 5),
        ("DistantLight", "float inputs:angle = 1", 5e4 * math.pi * math.sin(0.5 * 0.0174533) ** 2),
    ],
)
def test_lights_give_the_irradiance_of_the_specification(
    kind: str, values: str, expected: float, tmp_path: Path
) -> None:
    light = LIGHT.format(kind=kind, values=values, place="(0, 0, 2, 1)")
    found = irradiance(tmp_path, light)
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_a_rectangle_light_is_as_wide_as_it_says(tmp_path: Path) -> None:
    light = LIGHT.format(
        kind="RectLight",
        values="float inputs:width = 0.02\n float inputs:height = 0.04\n"
        "color3f inputs:color = (1, 0.5, 0)",
        place="(0, 0, 2, 1)",
    )
    expected = 0.02 * 0.04 / 4 * np.array([1, 0.5, 0])
    np.testing.assert_allclose(irradiance(tmp_path, light), expected, rtol=0.02)


def test_camera_sees_right_on_the_right_and_up_above(tmp_path: Path) -> None:
    plane = 'def Plane "Floor" { double width = 10\n double length = 10\n }\n'
    scene = loaded(tmp_path, plane.replace("{", "{\n")).scene
    hit = first_hit(scene, 0.75, 0.25)  # a quarter of the 4 m that 90 degrees - half of them - see
    np.testing.assert_allclose(np.array(hit.p).ravel(), [1, 1, 0], atol=1e-3)
    np.testing.assert_allclose(np.array(hit.n).ravel(), [0, 0, 1], atol=1e-6)


@pytest.mark.parametrize(("side", "place"), [("horizontal", [1, 0, 0]), ("vertical", [0, 1, 0])])
def test_a_shifted_lens_moves_the_picture(side: str, place: list[int], tmp_path: Path) -> None:
    shift = f"float {side}ApertureOffset = 5\n    float focalLength"
    shifted = CAMERA.replace("float focalLength", shift)
    plane = 'def Plane "Floor"\n{\n double width = 10\n double length = 10\n}\n'
    scene = load_usd(stage(tmp_path, plane, camera=shifted)).scene
    hit = first_hit(scene, 0.5, 0.5)  # The film's middle is 5 / 20 of 4 m off the axis.
    np.testing.assert_allclose(np.array(hit.p).ravel(), place, atol=1e-3)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize("kind", ["Cylinder", "Cone", "Capsule"])
def test_solids_lie_along_their_axis(kind: str, axis: str, tmp_path: Path) -> None:
    size = "double radius = 0.5\n double height = 3"
    prim = f'def {kind} "S"\n{{\n {size}\n token axis = "{axis}"\n}}\n'
    box = loaded(tmp_path, prim).scene.shapes()[0].bbox()
    half = np.full(3, 0.5)
    half["XYZ".index(axis)] = 2.0 if kind == "Capsule" else 1.5
    np.testing.assert_allclose(np.array(box.max), half, atol=2e-3)
    np.testing.assert_allclose(np.array(box.min), -half, atol=2e-3)


MESH = """
def Mesh "Quad"
{{
    uniform token subdivisionScheme = "none"
    uniform token orientation = "{orientation}"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    float3 xformOp:scale = ({scale}, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:scale"]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] ( interpolation = "vertex" )
}}
"""


@pytest.mark.parametrize(
    ("orientation", "scale", "up"),
    [("rightHanded", 1, 1), ("leftHanded", 1, -1), ("rightHanded", -1, 1), ("leftHanded", -1, -1)],
)
def test_faces_keep_their_side(orientation: str, scale: int, up: int, tmp_path: Path) -> None:
    mesh = MESH.format(orientation=orientation, scale=scale)
    hit = first_hit(loaded(tmp_path, mesh).scene, 0.55, 0.45)
    np.testing.assert_allclose(np.array(hit.n).ravel(), [0, 0, up], atol=1e-6)
    uv = np.array(hit.uv).ravel()
    np.testing.assert_allclose(uv, [0.5 + scale * 0.1, 0.6], atol=1e-3)


MATERIAL = """
def Material "M"
{{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S"
    {{
        uniform token info:id = "UsdPreviewSurface"
        {inputs}
        token outputs:surface
    }}
    def Shader "T"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./map.exr@
        token inputs:sourceColorSpace = "raw"
        float3 outputs:rgb
        float outputs:g
    }}
}}
def Plane "Floor" ( prepend apiSchemas = ["MaterialBindingAPI"] )
{{
    double width = 10
    double length = 10
    rel material:binding = </M>
}}
"""


def test_emission_and_its_texture(tmp_path: Path) -> None:
    write_exr(tmp_path / "map.exr", np.full((2, 2, 3), (1, 2, 3), np.float32))
    for inputs, expected in (
        ("color3f inputs:emissiveColor = (3, 2, 1)", [3, 2, 1]),
        ("color3f inputs:emissiveColor.connect = </M/T.outputs:rgb>", [1, 2, 3]),
    ):
        scene = loaded(tmp_path, MATERIAL.format(inputs=inputs)).scene
        hit = first_hit(scene, 0.5, 0.5)
        np.testing.assert_allclose(np.array(hit.emitter(scene).eval(hit)).ravel(), expected)


GLOWING = MATERIAL[: MATERIAL.index("def Plane")].replace(
    "{inputs}", "color3f inputs:emissiveColor{}"
)
PANELS = """
def Mesh "Panels" ( prepend apiSchemas = ["MaterialBindingAPI"] )
{{
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 4, 5, 6, 7]
    point3f[] points = [(-3, -1, 2), (-3, 1, 2), (-1, 1, 2), (-1, -1, 2),
                        (1, -1, 2), (1, 1, 2), (3, 1, 2), (3, -1, 2)]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = {st} ( interpolation = "vertex" )
    {normals}
    rel material:binding = </M>
}}
"""


WHOLE = [(0, 0), (0, 1), (1, 1), (1, 0)]
HALVES = [(0, 0), (0, 1), (0.5, 1), (0.5, 0), (0.5, 0), (0.5, 1), (1, 1), (1, 0)]


@pytest.mark.parametrize(
    ("corners", "share"),
    [
        (HALVES, 1),
        (WHOLE * 2, 1),
        ([(0, 0), (0, 2), (2, 2), (2, 0)] * 2, 1),
        ([(0.25, 0.25)] * 8, 1.5),
    ],
    ids=["once", "twice", "repeated", "one point"],
)
def test_all_of_a_glowing_picture_gives_light(
    corners: list[tuple[float, float]], share: float, tmp_path: Path
) -> None:
    """Two panels show it; Mitsuba's textured light aims at one place of each pixel."""
    picture = np.ones((2, 2, 3), np.float32)
    picture[:, 0] = 3
    write_exr(tmp_path / "map.exr", picture)
    panels = PANELS.format(st=corners, normals="")
    inputs = (".connect = </M/T.outputs:rgb>", " = (2, 2, 2)")
    pictured, even = (irradiance(tmp_path, GLOWING.format(v) + panels) for v in inputs)
    np.testing.assert_allclose(pictured, even * share, rtol=0.02)


def test_a_panel_that_shines_gives_all_of_its_light_under_any_normals(tmp_path: Path) -> None:
    glow = GLOWING.format(" = (2, 2, 2)")
    bulged = [(-0.6, -0.6, -0.53), (-0.6, 0.6, -0.53), (0.6, 0.6, -0.53), (0.6, -0.6, -0.53)]
    normals = ("", f"normal3f[] normals = {bulged * 2}")
    flat, smooth = (
        irradiance(tmp_path, glow + PANELS.format(st=WHOLE * 2, normals=which)) for which in normals
    )
    np.testing.assert_allclose(smooth, flat, rtol=0.02)


def test_a_texture_without_coordinates_is_read_at_one_point(tmp_path: Path) -> None:
    """It glows as any light does, also seen by Mitsuba's own integrator."""
    picture = np.arange(12, dtype=np.float32).reshape(2, 2, 3)
    write_exr(tmp_path / "map.exr", picture)
    sphere = MATERIAL.replace("Plane", "Sphere").replace("width = 10", "radius = 1")
    found = loaded(
        tmp_path, sphere.format(inputs="color3f inputs:emissiveColor.connect = </M/T.outputs:rgb>")
    )
    assert any("without texture coordinates" in note for note in found.notes)
    image = mi.render(found.scene, integrator=mi.load_dict({"type": "path"}), spp=4)
    middle = np.array(image)[image.shape[0] // 2, image.shape[1] // 2]
    np.testing.assert_allclose(middle[:3], picture.mean((0, 1)), rtol=1e-5)


def test_opacity_lets_light_through(tmp_path: Path) -> None:
    inputs = "float inputs:opacity = 0.25\n color3f inputs:diffuseColor = (0, 0, 0)"
    scene = loaded(tmp_path, MATERIAL.format(inputs=inputs)).scene
    hit = first_hit(scene, 0.5, 0.5)
    through = hit.bsdf().eval_null_transmission(hit)
    np.testing.assert_allclose(np.array(through).ravel(), 0.75, atol=1e-6)


def test_a_luminaire_is_where_its_prim_is(tmp_path: Path) -> None:
    bundle = lamps.ball().write(tmp_path / "ball.plux")
    prim = """
def Xform "Lamp" ( apiSchemas = ["PureLightLuminaireAPI"] )
{
    uniform asset purelight:bundle = @./ball.plux@
    float purelight:dimmer = 0.5
    rel purelight:fallback = </Lamp/Stand_in>
    double3 xformOp:translate = (1, 2, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def SphereLight "Stand_in"
    {
    }
}
"""
    scene = loaded(tmp_path, prim).scene
    assert len(scene.emitters()) == 1
    emitter = scene.emitters()[0]
    assert emitter.level == 0.5
    np.testing.assert_allclose(np.array(emitter.to_world.matrix).reshape(4, 4)[:3, 3], [1, 2, 3])
    assert bundle is None or emitter.luminaire.path.name == "ball.plux"


def test_what_is_hidden_is_not_read(tmp_path: Path) -> None:
    sphere = 'def Sphere "{name}"\n{{\n {how}\n}}\n'
    prims = [
        sphere.format(name="a", how='token visibility = "invisible"'),
        sphere.format(name="b", how='uniform token purpose = "guide"'),
        sphere.format(name="c", how=""),
    ]
    assert len(loaded(tmp_path, *prims).scene.shapes()) == 1


def test_notes_name_what_is_left_out(tmp_path: Path) -> None:
    found = loaded(
        tmp_path,
        'def BasisCurves "Hair"\n{\n}\n',
        MESH.format(orientation="rightHanded", scale=1).replace('"none"', '"loop"'),
        MATERIAL.format(inputs="float inputs:occlusion.connect = </M/T.outputs:g>"),
    )
    assert [note.split(":")[0] for note in found.notes] == ["/Hair", "/Quad", "/M/S"]


def test_a_participating_medium_is_named(tmp_path: Path) -> None:
    fog = 'def Shader "Fog"\n    {\n        token outputs:volume\n    }\n    def Shader "S"'
    material = MATERIAL.format(inputs="").replace('def Shader "S"', fog)
    volume = "token outputs:volume.connect = </M/Fog.outputs:volume>"
    material = material.replace("token outputs:surface", f"{volume}\n    token outputs:surface", 1)
    found = loaded(tmp_path, MESH.format(orientation="rightHanded", scale=1), material)
    assert found.notes == ["/M/Fog: a participating medium; rendered without it"]


def fault(path: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main([str(path), "--output", str(path.with_name("o.exr")), *arguments]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    return lines[0]


def test_faults_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no camera" in fault(stage(tmp_path, camera=""), capsys)
    assert "no camera /No" in fault(stage(tmp_path), capsys, "--camera", "/No")
    lamp = 'def Xform "L" ( apiSchemas = ["PureLightLuminaireAPI"] )\n{\n'
    missing = lamp + "    uniform asset purelight:bundle = @./no.plux@\n}\n"
    assert "no.plux" in fault(stage(tmp_path, missing), capsys)
    lamps.ball().write(tmp_path / "ball.plux")
    stale = (
        lamp + "    uniform asset purelight:bundle = @./ball.plux@\n"
        f'    uniform string purelight:bundleDigest = "{"0" * 64}"\n}}\n'
    )
    assert "export both again" in fault(stage(tmp_path, stale), capsys)
    broken = tmp_path / "scene.usda"
    broken.write_text("#usda 1.0\ndef {")
    assert "OpenUSD cannot read it: 2:1:" in fault(broken, capsys)
    with pytest.raises(PureLightError, match="no camera"):
        load_usd(stage(tmp_path, camera=""))


def test_renders_from_the_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    light = LIGHT.format(kind="SphereLight", values="float inputs:radius = 1", place="(0, 0, 0, 1)")
    path = stage(tmp_path, light)
    output = tmp_path / "o.exr"
    command = [str(path), "--output", str(output), "--width", "9", "--spp", "16"]
    assert main(command) == 0
    picture = np.array(mi.Bitmap(str(output)))
    assert picture.shape == (9, 9, 3)
    np.testing.assert_allclose(picture[4, 4], 1, rtol=1e-3)
    assert dr.backend_v(mi.Float) == dr.JitBackend.LLVM


def test_a_light_of_no_finite_strength_is_named(tmp_path: Path) -> None:
    for values in ("float inputs:exposure = 1e9", "float inputs:intensity = inf"):
        light = LIGHT.format(kind="SphereLight", values=values, place="(0, 0, 2, 1)")
        notes = loaded(tmp_path, light).notes
        assert any("not of finite strength" in note for note in notes), values
