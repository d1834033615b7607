"""USD: units, axes, lights, materials and what is hidden."""

from __future__ import annotations

import io
import re
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import.importing import read_lamp
from purelight_import.model.lamp import Part
from purelight_import.model.material import Material
from purelight_import.model.picture import Picture
from purelight_import.read.usd import read_usd
from tests.support.lamp_files import model, usd

LIGHT = """
    def {kind} "Light"
    {{
        float inputs:intensity = 50
        {values}
        double3 xformOp:translate = (0, 10, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""


U = [(3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3), (0, 0), (3, 0)]

pytestmark = pytest.mark.usefixtures("at_once")


def parts(folder: Path, *pieces: model.Piece, more: str = "", **form: Any) -> dict[str, Part]:
    path = usd.write(folder, list(pieces), more=more, **form)
    return {part.name: part for part in read_usd(path).placed().parts}


@pytest.mark.parametrize(("scale", "up"), [(100.0, "Y"), (1.0, "Z"), (1000.0, "Z")])
def test_units_and_axes(scale: float, up: str, tmp_path: Path) -> None:
    base = parts(tmp_path, model.base(), scale=scale, up=up)["Base"]
    np.testing.assert_allclose(base.mesh.bounds.mean(0), [0, 0, 0.08], atol=1e-6)
    np.testing.assert_allclose(np.ptp(base.mesh.bounds, axis=0), [0.05, 0.05, 0.02], atol=1e-6)


@pytest.mark.parametrize(
    ("kind", "values", "area"),
    [
        ("SphereLight", "float inputs:radius = 2", 4 * np.pi * 0.02**2),
        ("DiskLight", "float inputs:radius = 2", np.pi * 0.02**2),
        ("RectLight", "float inputs:width = 4\n float inputs:height = 1", 0.04 * 0.01),
        ("CylinderLight", "float inputs:radius = 1\n float inputs:length = 5", np.pi * 0.02 * 0.05),
    ],
)  # fmt: skip
def test_lights_have_their_shape_and_place(
    kind: str, values: str, area: float, tmp_path: Path
) -> None:
    found = parts(tmp_path, model.base(), more=LIGHT.format(kind=kind, values=values))["Light"]
    assert found.mesh.area == pytest.approx(area, rel=0.01)
    np.testing.assert_allclose(found.mesh.bounds.mean(0), [0, 0, 0.1], atol=1e-4)
    np.testing.assert_allclose(found.radiance, [50, 50, 50])
    if kind in ("DiskLight", "RectLight"):  # which shine along -Z, the luminaire's +Y
        assert (found.mesh.cross[:, 1] > 0).all()


def test_a_light_has_the_colour_of_its_temperature(tmp_path: Path) -> None:
    warm = "bool inputs:enableColorTemperature = 1\n float inputs:colorTemperature = 2700"
    light = parts(tmp_path, more=LIGHT.format(kind="SphereLight", values=warm))["Light"]
    r, g, b = np.array(light.radiance)
    assert r > g > b > 0
    assert 0.2126 * r + 0.7152 * g + 0.0722 * b == pytest.approx(50, rel=1e-3)


def test_skies_are_the_rooms(tmp_path: Path) -> None:
    dome = 'def DomeLight "Sky"\n{\n    float inputs:intensity = 1\n}\n'
    lamp, _ = read_lamp(usd.write(tmp_path, model.lamp(), more=dome))
    assert any("infinity" in line and "Sky" in line for line in lamp.notes.lines())


@pytest.mark.parametrize(
    ("opacity", "mode", "through"),
    [(0.0, "", 1.0), (0.8, "", 0.2), (0.3, 'token inputs:opacityMode = "presence"', 0.0)],
)
def test_opacity_is_glass_unless_it_is_absence(
    opacity: float, mode: str, through: float, tmp_path: Path
) -> None:
    path = usd.write(tmp_path, [model.base()])
    text = path.read_text().replace("inputs:opacity = 1.0", f"inputs:opacity = {opacity}\n{mode}")
    path.write_text(text)
    (part,) = read_usd(path).parts
    assert isinstance(part.material, Material)
    assert part.material.transmission == pytest.approx(through)
    assert part.material.opacity == pytest.approx(opacity if mode else 1.0)


def test_what_is_invisible_or_a_guide_is_left_out(tmp_path: Path) -> None:
    path = usd.write(tmp_path, [model.base(), model.bulb()])
    hidden = '        token visibility = "invisible"\n        int[] faceVertexCounts'
    path.write_text(path.read_text().replace("        int[] faceVertexCounts", hidden, 1))
    assert [part.name for part in read_usd(path).parts] == ["Bulb"]
    guide = hidden.replace('token visibility = "invisible"', 'uniform token purpose = "guide"')
    path.write_text(path.read_text().replace(hidden, guide))
    assert [part.name for part in read_usd(path).parts] == ["Bulb"]


@pytest.mark.parametrize(("orientation", "up"), [("rightHanded", 1), ("leftHanded", -1)])
def test_concave_polygons_are_filled_and_no_more(orientation: str, up: int, tmp_path: Path) -> None:
    """A dart of 6 m² and a U of 7 m², from corners that do not see all the others."""
    dart = [(2, -1, 0), (0, 3, 0), (-2, -1, 0), (0, 0, 0)]
    u = [(x + 10, y, 0) for x, y in U]
    path = usd.write(tmp_path, [model.base()], scale=1.0, up="Z")
    counts = f'uniform token orientation = "{orientation}"\n        int[] faceVertexCounts = [4, 8]'
    text = re.sub(r"int\[\] faceVertexCounts = .*", counts, path.read_text())
    text = re.sub(r"(faceVertexIndices) = .*", rf"\1 = {list(range(12))}", text)
    path.write_text(re.sub(r"(point3f\[\] points) = .*", rf"\1 = {dart + u}", text))
    (part,) = read_usd(path).placed().parts
    assert part.mesh.area == pytest.approx(13)
    assert (up * part.mesh.cross[:, 2] > 0).all()


READER = """
        def Shader "T"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @quarters.png@
            token inputs:wrapS = "repeat"
            float2 inputs:st.connect = </ShelfLight/Brass/X.outputs:result>
            float3 outputs:rgb
        }
        def Shader "X"
        {
            uniform token info:id = "UsdTransform2d"
            float2 inputs:in.connect = </ShelfLight/Brass/R.outputs:result>
            float2 inputs:scale = (0.5, 1)
            float inputs:rotation = 90
            float2 inputs:translation = (1, 0.5)
            float2 outputs:result
        }
        def Shader "R"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "UVMap"
            float2 outputs:result
        }
        def Shader "S"
"""


@pytest.mark.parametrize(
    ("output", "color", "expected"),
    [("a", (255, 128, 0), 1.0), ("a", (255, 128, 0, 51), 0.2), ("g", (51, 255), 0.2)],
)
def test_a_channel_is_the_one_that_is_named(
    output: str, color: tuple[int, ...], expected: float, tmp_path: Path
) -> None:
    """What a picture lacks of alpha is whole; grey is all colours."""
    pixels = np.full((2, 2, len(color)), color, np.uint8)
    Image.fromarray(pixels, {2: "LA"}.get(len(color))).save(tmp_path / "quarters.png")
    path = usd.write(tmp_path, [model.base()])
    reader = READER.replace("outputs:rgb", f"outputs:{output}").replace("float3", "float")
    text = path.read_text().replace('        def Shader "S"\n', reader)
    connected = f"inputs:opacity.connect = </ShelfLight/Brass/T.outputs:{output}>"
    path.write_text(text.replace("inputs:opacity = 1.0", connected))
    (part,) = read_usd(path).parts
    assert isinstance(part.material, Material)
    found = part.material.opacity
    value = found.linear.mean() if isinstance(found, Picture) else found
    assert value == pytest.approx(expected, abs=1e-3)


def test_texture_coordinates_by_the_name_and_transform_that_are_said(tmp_path: Path) -> None:
    quarters = 255 * np.array([[(1, 0, 0), (0, 1, 0)], [(0, 0, 1), (1, 1, 1)]], np.uint8)
    Image.fromarray(quarters).save(tmp_path / "quarters.png")
    path = usd.write(tmp_path, [model.base()])
    text = path.read_text().replace('        def Shader "S"\n', READER)
    connected = "color3f inputs:diffuseColor.connect = </ShelfLight/Brass/T.outputs:rgb>"
    text = text.replace("color3f inputs:diffuseColor = (0.8, 0.6, 0.3)", connected)
    uv = 'texCoord2f[] primvars:UVMap = [(0.5, 0.1)] ( interpolation = "constant" )'
    path.write_text(text.replace("        point3f[]", f"        {uv}\n        point3f[]"))
    (part,) = read_usd(path).parts
    assert isinstance(part.material, Material)
    assert isinstance(part.material.base_color, Picture)
    assert part.mesh.uv is not None
    np.testing.assert_allclose(part.mesh.uv[0], [0.5, 0.9], atol=1e-6)
    # (0.5, 0.1) is scaled to (0.25, 0.1), turned to (-0.1, 0.25), moved to (0.9, 0.75)
    np.testing.assert_allclose(part.material.base_color.at(part.mesh.uv[:1]), [(0, 1, 0)])


@pytest.mark.parametrize(
    ("shader", "weight"),
    [("ND_standard_surface_surfaceshader", "base"), ("ND_open_pbr_surface_surfaceshader",
                                                     "base_weight")],
)  # fmt: skip
def test_the_weight_of_the_base_counts(shader: str, weight: str, tmp_path: Path) -> None:
    path = usd.write(tmp_path, [model.base()])
    text = path.read_text().replace('"UsdPreviewSurface"', f'"{shader}"')
    inputs = f"float inputs:{weight} = 0.05\n color3f inputs:base_color = (1, 1, 0.5)"
    path.write_text(text.replace("color3f inputs:diffuseColor = (0.8, 0.6, 0.3)", inputs))
    (part,) = read_usd(path).parts
    assert isinstance(part.material, Material)
    np.testing.assert_allclose(part.material.base_color, [0.05, 0.05, 0.025], rtol=1e-5)


NETWORK = """#usda 1.0
( defaultPrim = "Lamp"
  metersPerUnit = 0.01
  upAxis = "Z" )
def Xform "Lamp"
{{
    def Sphere "Bulb" ( prepend apiSchemas = ["MaterialBindingAPI"{api}] )
    {{
        double radius = 2
        {light}
        rel material:binding = </Lamp/Paint>
    }}
    def Material "Paint"
    {{
        token outputs:mtlx:surface.connect = </Lamp/Paint/S.outputs:surface>
        def Shader "S"
        {{
            uniform token info:id = "ND_{shader}_surfaceshader"
            {inputs}
            token outputs:surface
        }}
    }}
}}
"""
OPEN_PBR, STANDARD = "open_pbr_surface", "standard_surface"


def bulb(folder: Path, inputs: str, shader: str = OPEN_PBR, api: str = "", light: str = "") -> Part:
    """In metres."""
    path = folder / "bulb.usda"
    path.write_text(NETWORK.format(inputs=inputs, shader=shader, api=api, light=light))
    (part,) = read_usd(path).placed().parts
    return part


def test_light_of_openpbr_is_in_candela_per_square_metre(tmp_path: Path) -> None:
    glows = "float inputs:emission_luminance = 1366\n color3f inputs:emission_color = (1, 0.5, 0)"
    np.testing.assert_allclose(bulb(tmp_path, glows).radiance, [2, 1, 0], rtol=1e-6)
    watts = glows.replace("emission_luminance", "emission")
    np.testing.assert_allclose(bulb(tmp_path, watts, STANDARD).radiance, [1366, 683, 0], rtol=1e-6)


@pytest.mark.parametrize(
    ("shader", "through"), [(OPEN_PBR, "transmission_weight"), (STANDARD, "transmission")]
)
def test_glass_has_its_colour_at_a_depth(shader: str, through: str, tmp_path: Path) -> None:
    """Of the stage's unit, centimetres; without a depth each surface has it."""
    glass = f"float inputs:{through} = 1\n color3f inputs:transmission_color = (0.5, 1, 1)"
    tinted = bulb(tmp_path, glass, shader).material
    assert isinstance(tinted, Material)
    assert (tinted.base_color, tinted.attenuation) == ((0.5, 1, 1), None)
    deep = bulb(tmp_path, glass + "\n float inputs:transmission_depth = 4", shader).material
    assert isinstance(deep, Material)
    assert deep.base_color == (1, 1, 1)
    np.testing.assert_allclose(deep.attenuation, [np.log(2) / 0.04, 0, 0], rtol=1e-6)


@pytest.mark.parametrize(
    ("shader", "inputs"),
    [(OPEN_PBR, "float inputs:geometry_opacity = 0.25"),
     (STANDARD, "color3f inputs:opacity = (0.25, 0.25, 0.25)")],
)  # fmt: skip
def test_opacity_of_other_shaders(shader: str, inputs: str, tmp_path: Path) -> None:
    material = bulb(tmp_path, inputs, shader).material
    assert isinstance(material, Material)
    assert material.opacity == 0.25


@pytest.mark.parametrize("normalize", [0, 1])
def test_a_mesh_may_be_a_light(normalize: int, tmp_path: Path) -> None:
    lit = f"float inputs:intensity = 5\n bool inputs:normalize = {normalize}"
    part = bulb(tmp_path, "", api=', "MeshLightAPI"', light=lit)
    area = part.mesh.area * 1e4 if normalize else 1
    np.testing.assert_allclose(part.radiance, [5 / area] * 3, rtol=1e-6)
    dark = bulb(tmp_path, "", api=', "MeshLightAPI"', light="float inputs:intensity = 0")
    assert dark.radiance is None


def test_textures_within_a_package(tmp_path: Path) -> None:
    buffer = io.BytesIO()
    Image.fromarray(np.full((2, 2, 3), (255, 0, 0), np.uint8)).save(buffer, "PNG")
    (tmp_path / "red.png").write_bytes(buffer.getvalue())
    path = usd.write(tmp_path, [model.base()])
    reader = """
        def Shader "T"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @red.png@
            float3 outputs:rgb
        }
        def Shader "S"
"""
    text = path.read_text().replace('        def Shader "S"\n', reader)
    connected = "color3f inputs:diffuseColor.connect = </ShelfLight/Brass/T.outputs:rgb>"
    path.write_text(text.replace("color3f inputs:diffuseColor = (0.8, 0.6, 0.3)", connected))
    from pxr import UsdUtils

    package = tmp_path / "package[1]"
    package.mkdir()
    assert UsdUtils.CreateNewUsdzPackage(str(path), str(package / "lamp.usdz"))
    for lamp in (read_usd(path), read_usd(package / "lamp.usdz")):
        material = lamp.parts[0].material
        assert isinstance(material, Material)
        assert isinstance(material.base_color, Picture)
        np.testing.assert_allclose(material.base_color.mean(), [1, 0, 0])


def test_layers_outside_the_folder_are_refused(tmp_path: Path, fault: Any) -> None:
    inner = tmp_path / "lamp"
    inner.mkdir()
    usd.write(tmp_path, model.lamp(), "secret.usda")
    path = inner / "lamp.usda"
    reference = 'def "A" ( prepend references = @../secret.usda@ )\n{\n}\n'
    path.write_text(f'#usda 1.0\n( defaultPrim = "A" )\n{reference}')
    assert "outside" in fault(path)


@pytest.mark.parametrize("size", [0, 10, 400])
def test_broken_files_of_each_kind(size: int, tmp_path: Path, fault: Any) -> None:
    path = usd.write(tmp_path, model.lamp())
    from pxr import Sdf

    binary = tmp_path / "lamp.usdc"
    Sdf.Layer.FindOrOpen(str(path)).Export(str(binary))
    package = tmp_path / "lamp.usdz"
    with zipfile.ZipFile(package, "w") as archive:
        archive.write(binary, "lamp.usdc")
    for file in (path, binary, package):
        cut = tmp_path / f"cut{file.suffix}"
        shutil.copy(file, cut)
        with cut.open("r+b") as handle:
            handle.truncate(size)
        assert str(cut) in fault(cut)


def test_folders_may_have_brackets_in_their_names(tmp_path: Path) -> None:
    folder = tmp_path / "lamp[1]"
    folder.mkdir()
    assert read_usd(usd.write(folder, model.lamp())).parts
