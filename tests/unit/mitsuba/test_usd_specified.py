"""Stages against the words of UsdPreviewSurface, UsdLux and UsdRender, where renderers differ."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba.usd_scene import load_usd
from purelight_onnx.picture import write_exr
from tests.support.usd_stages import (
    CAMERA,
    LIGHT,
    first_hit,
    irradiance,
    loaded,
    stage,
    textured,
)

# Lights


@pytest.mark.parametrize("kind", ["SphereLight", "CylinderLight"])
@pytest.mark.parametrize("mirrored", ["(-1, 1, 1)", "(1, 1, -1)"])
def test_a_mirrored_light_gives_the_light_of_its_twin(
    kind: str, mirrored: str, tmp_path: Path
) -> None:
    light = LIGHT.format(kind=kind, values="float3 xformOp:scale = SCALE", place="(0, 0, 2, 1)")
    light = light.replace('["xformOp:transform"]', '["xformOp:transform", "xformOp:scale"]')
    scales = (mirrored, "(1, 1, 1)")
    found, twin = (irradiance(tmp_path, light.replace("SCALE", scale)) for scale in scales)
    np.testing.assert_allclose(found, twin, rtol=0.02)
    assert twin[0] > 0.01


@pytest.mark.parametrize("order", [1, -1])
def test_lights_from_all_around_add_up(order: int, tmp_path: Path) -> None:
    write_exr(tmp_path / "sky.exr", np.full((4, 8, 3), 2, np.float32))
    plain = 'def DomeLight "A" {\n float inputs:intensity = 3\n}\n'
    sky = 'def DomeLight "B" {\n asset inputs:texture:file = @./sky.exr@\n}\n'
    np.testing.assert_allclose(
        irradiance(tmp_path, "".join([plain, sky][::order])), 5 * np.pi, rtol=0.02
    )
    again = plain.replace('"A"', '"C"')
    np.testing.assert_allclose(irradiance(tmp_path, plain + again), 6 * np.pi, rtol=0.02)
    notes = loaded(tmp_path, sky, sky.replace('"B"', '"C"')).notes
    assert notes == ["/C: a second dome light with a texture; left out"]


# Textures

OPACITY = "float inputs:opacity.connect = </M/T.outputs:{}>"
HALF = 128 / 255
LINEAR_HALF = 0.2158605


def pictures(folder: Path) -> None:
    """One of each number of channels, of eight bits and of sixteen."""
    form, eight = mi.Bitmap.PixelFormat, np.full((4, 4, 4), (128, 128, 128, 64), np.uint8)
    for name, kind, chosen in (
        ("grey", form.Y, [0]),
        ("grey_alpha", form.YA, [0, 3]),
        ("rgb", form.RGB, [0, 1, 2]),
        ("rgba", form.RGBA, [0, 1, 2, 3]),
    ):
        mi.Bitmap(np.ascontiguousarray(eight[..., chosen]), kind).write(str(folder / f"{name}.png"))
    deep = mi.Bitmap(np.full((4, 4, 3), round(HALF * 65535), np.uint16), form.RGB)
    deep.write(str(folder / "deep.png"))


def opacity(folder: Path, file: str, output: str, texture: str = "", inputs: str = "") -> float:
    given = OPACITY.format(output) + inputs
    return covered(folder, textured(given, texture, file=file))


def covered(folder: Path, material: str) -> float:
    scene = loaded(folder, material).scene
    hit = first_hit(scene, 0.5, 0.5)
    bsdf = hit.bsdf()
    null = mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)
    through = np.ravel(np.array(bsdf.eval_null_transmission(hit)))[0]
    return 1 - float(through) if np.ravel(np.array(null))[0] else 1.0


@pytest.mark.parametrize(
    ("file", "output", "expected"),
    [
        ("grey.png", "r", HALF),
        ("grey.png", "g", HALF),
        ("grey.png", "a", 1),
        ("grey_alpha.png", "g", HALF),
        ("grey_alpha.png", "a", 64 / 255),
        ("rgb.png", "r", LINEAR_HALF),
        ("rgb.png", "a", 1),
        ("rgba.png", "g", LINEAR_HALF),
        ("rgba.png", "a", 64 / 255),
        ("deep.png", "r", HALF),
    ],
)
def test_a_channel_is_the_one_that_is_named(
    file: str, output: str, expected: float, tmp_path: Path
) -> None:
    """Colour pictures of eight bits are sRGB unless they say otherwise, and no others."""
    pictures(tmp_path)
    assert opacity(tmp_path, file, output) == pytest.approx(expected, abs=2e-3)


def test_an_alpha_that_is_not_there_has_scale_and_bias(tmp_path: Path) -> None:
    pictures(tmp_path)
    scaled = "float4 inputs:scale = (1, 1, 1, 0.5)\n float4 inputs:bias = (0, 0, 0, 0.25)"
    assert opacity(tmp_path, "rgb.png", "a", scaled) == pytest.approx(0.75, abs=1e-3)
    found = opacity(tmp_path, "grey_alpha.png", "a", scaled)
    assert found == pytest.approx(0.25 + 0.5 * 64 / 255, abs=2e-3)


@pytest.mark.parametrize(("threshold", "expected"), [(0.4, 1), (0.6, 0)])
def test_opacity_is_all_or_nothing_about_its_threshold(
    threshold: float, expected: float, tmp_path: Path
) -> None:
    pictures(tmp_path)
    cut = f"\n float inputs:opacityThreshold = {threshold}"
    assert opacity(tmp_path, "grey.png", "r", inputs=cut) == expected
    plain = "float inputs:opacity = 0.5" + cut
    assert covered(tmp_path, textured(plain)) == expected


@pytest.mark.parametrize(
    ("texture", "note"),
    [
        ('token inputs:wrapS = "black"\n token inputs:wrapT = "black"', "black around it"),
        ('token inputs:wrapS = "repeat"\n token inputs:wrapT = "clamp"', "by repeat along both"),
        ('token inputs:wrapS = "clamp"\n token inputs:wrapT = "clamp"', None),
        ("", None),
    ],
)
def test_how_a_picture_goes_on_is_noted_where_it_goes_on_otherwise(
    texture: str, note: str | None, tmp_path: Path
) -> None:
    pictures(tmp_path)
    text = textured(OPACITY.format("r"), texture, file="rgb.png")
    notes = loaded(tmp_path, text).notes
    assert len(notes) == (note is not None)
    assert note is None or note in notes[0]


# Cameras

SETTINGS = """
def Scope "Render"
{{
    def RenderSettings "Settings"
    {{
        uniform int2 resolution = {size}
        {more}
    }}
}}
"""
HEAD = 'upAxis = "Z"\n'


def seen(folder: Path, size: str, more: str = "", camera: str = CAMERA) -> np.ndarray:
    """Width and height, in metres on the floor 4 m away, of what a camera of 90 degrees sees."""
    path = stage(folder, SETTINGS.format(size=size, more=more), camera=camera)
    head = HEAD + '    renderSettingsPrimPath = "/Render/Settings"\n'
    path.write_text(path.read_text().replace(HEAD, head))
    sensor = load_usd(path).scene.sensors()[0]
    corners = []
    for place in ([0, 0], [1, 1]):
        ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(place), 0.5)
        corners.append(np.ravel(np.array(ray.o + ray.d * (-ray.o.z / ray.d.z)))[:2])
    return np.abs(np.subtract(*corners))


@pytest.mark.parametrize(
    ("size", "policy", "expected"),
    [
        ("(64, 64)", "", (4, 4)),
        ("(128, 64)", "", (8, 4)),
        ("(64, 128)", "", (4, 8)),
        ("(128, 64)", "expandAperture", (8, 4)),
        ("(128, 64)", "cropAperture", (4, 2)),
        ("(64, 128)", "cropAperture", (2, 4)),
        ("(128, 64)", "adjustApertureWidth", (8, 4)),
        ("(128, 64)", "adjustApertureHeight", (4, 2)),
        ("(64, 128)", "adjustApertureHeight", (4, 8)),
    ],
)
def test_an_aperture_conforms_by_the_policy(
    size: str, policy: str, expected: tuple[float, float], tmp_path: Path
) -> None:
    more = f'uniform token aspectRatioConformPolicy = "{policy}"' if policy else ""
    np.testing.assert_allclose(seen(tmp_path, size, more), expected, rtol=1e-4)


def test_a_shift_is_of_the_aperture_that_the_camera_states(tmp_path: Path) -> None:
    """Half of its width to the right, whatever the picture shows besides."""
    shifted = CAMERA.replace("\n}", "\n    float horizontalApertureOffset = 10\n}")
    path = stage(tmp_path, SETTINGS.format(size="(128, 64)", more=""), camera=shifted)
    head = HEAD + '    renderSettingsPrimPath = "/Render/Settings"\n'
    path.write_text(path.read_text().replace(HEAD, head))
    ray, _ = load_usd(path).scene.sensors()[0].sample_ray(0, 0.5, mi.Point2f(0.5, 0.5), 0.5)
    place = np.ravel(np.array(ray.o + ray.d * (-ray.o.z / ray.d.z)))
    np.testing.assert_allclose(place, [2, 0, 0], atol=1e-4)


def test_what_a_camera_cannot_do_is_noted(tmp_path: Path) -> None:
    blurred = "\n    float horizontalApertureOffset = 5\n    float fStop = 8\n"
    camera = CAMERA.replace("\n}", blurred + "    float focusDistance = 4\n}")
    notes = load_usd(stage(tmp_path, camera=camera)).notes
    assert any("shifted lens" in note for note in notes)
    with pytest.raises(PureLightError, match="resolution must be at least"):
        seen(tmp_path, "(0, 0)")


# Values of another form than the schema's

MESH = """
def Mesh "Quad"
{{
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    uniform token subdivisionScheme = "none"
    {primvar} ( interpolation = "vertex" )
    {indices}
}}
"""


@pytest.mark.parametrize(
    ("primvar", "indices", "note"),
    [
        ("texCoord2f[] primvars:st = [(0, 0), (1, 0)]", "st:indices = [0, 1, 2, 9]", "primvar st"),
        ('string[] primvars:st = ["a", "b", "c", "d"]', "", "primvar st"),
        ("float2[] primvars:normals = [(1, 2), (1, 2), (1, 2), (1, 2)]", "", "primvar normals"),
        ("color3f[] primvars:displayColor = [(0, 0, 1)]", "displayColor:indices = [0, 5, 0, 0]",
         "primvar displayColor"),
    ],
)  # fmt: skip
def test_primvars_that_are_none_are_noted(
    primvar: str, indices: str, note: str, tmp_path: Path
) -> None:
    indices = indices and f"int[] primvars:{indices}"
    notes = loaded(tmp_path, MESH.format(primvar=primvar, indices=indices)).notes
    assert len(notes) == 1
    assert note in notes[0]


@pytest.mark.parametrize(
    ("inputs", "texture", "name"),
    [
        ("float inputs:diffuseColor = 0.5", "", "diffuseColor"),
        ("color3f inputs:roughness = (0.5, 0.5, 0.5)", "", "roughness"),
        ('string inputs:emissiveColor = "x"', "", "emissiveColor"),
        (OPACITY.format("r"), "float inputs:scale = 2", "scale"),
    ],
)
def test_inputs_of_another_type_are_noted(
    inputs: str, texture: str, name: str, tmp_path: Path
) -> None:
    pictures(tmp_path)
    notes = loaded(tmp_path, textured(inputs, texture, file="rgb.png")).notes
    assert len(notes) == 1
    assert f"{name} is of another type" in notes[0]


def test_a_light_of_no_colour_keeps_the_default(tmp_path: Path) -> None:
    light = LIGHT.format(
        kind="SphereLight", values='token inputs:color = "red"', place="(0, 0, 2, 1)"
    )
    found = loaded(tmp_path, light)
    assert found.notes == ["/Light: inputs:color is of another type; ignored"]
    assert len(found.scene.emitters()) == 1
