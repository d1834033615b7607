"""Stages with numbers that nobody means: drawn, noted, or refused in one line."""

from __future__ import annotations

import random
import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba.usd_scene import load_usd
from purelight_onnx.picture import write_exr
from tests.support.usd_stages import CAMERA, HEADER, LIGHT

NUMBER = re.compile(r'(?<![\w.@"#])-?\d+(?:\.\d+)?(?![\w."])')
STRANGE = ("nan", "inf", "-inf", "0", "-1", "-7", "1.5", "3e9", "1e30", "1e-30", "1e300")
LIGHTS = {
    "SphereLight": "float inputs:radius = 0.5\n float inputs:exposure = 1",
    "DiskLight": "float inputs:radius = 0.4\n float inputs:shaping:cone:angle = 30\n"
    " float inputs:shaping:focus = 2\n float inputs:shaping:cone:softness = 0.3",
    "RectLight": "float inputs:width = 1\n float inputs:height = 2\n"
    " color3f inputs:color = (1, 0.5, 0.2)",
    "CylinderLight": "float inputs:radius = 0.1\n float inputs:length = 2",
    "DomeLight": "float inputs:intensity = 0.5",
    "DistantLight": "float inputs:angle = 1\n float inputs:colorTemperature = 3000\n"
    " bool inputs:enableColorTemperature = 1",
}
SOLID = """
def {kind} "{kind}"
{{
    double radius = 0.3
    double height = 0.5
    double size = 0.4
    color3f[] primvars:displayColor = [(0.2, 0.3, 0.4)]
    double3 xformOp:translate = (0.3, 0.1, 0.2)
    double xformOp:rotateX = 20
    uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateX"]
}}
"""
MESH = """
def Mesh "Mesh" ( prepend apiSchemas = ["MaterialBindingAPI"] )
{
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]
    normal3f[] normals = [(0, 0, 1), (0, 0.6, 0.8), (0, 0, 1), (0, 0, 1)]
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] ( interpolation = "vertex" )
    rel material:binding = </M>
}
def Material "M"
{
    token outputs:surface.connect = </M/S.outputs:surface>
    def Shader "S"
    {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </M/T.outputs:rgb>
        color3f inputs:emissiveColor = (0.1, 0.2, 0.3)
        float inputs:roughness = 0.4
        float inputs:metallic = 0.2
        float inputs:ior = 1.5
        float inputs:opacity = 0.7
        float inputs:clearcoat = 0.3
        float inputs:clearcoatRoughness = 0.2
        token outputs:surface
    }
    def Shader "T"
    {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./map.exr@
        float4 inputs:scale = (1, 1, 1, 1)
        float4 inputs:bias = (0, 0, 0, 0)
        float3 outputs:rgb
    }
}
"""
SOLIDS = ("Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane")
STAGE = "".join([
    HEADER, CAMERA, MESH, *(SOLID.format(kind=kind) for kind in SOLIDS),
    *(LIGHT.format(kind=k, values=v, place="(1, 0.5, 2, 1)").replace('"Light"', f'"{k}"')
      for k, v in LIGHTS.items()),
])  # fmt: skip
PLACES = list(NUMBER.finditer(STAGE))[1:]  # The first is the version of the language
ROUNDS = 50


def picture(scene: mi.Scene) -> np.ndarray:
    """A small one."""
    parameters = mi.traverse(scene.sensors()[0].film())
    parameters["size"] = [8, 8]
    parameters.update()
    integrator = mi.load_dict({"type": "purelight", "max_depth": 3})
    return np.array(mi.render(scene, integrator=integrator, spp=4))


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 8))]
)
def test_strange_numbers(seed: int, tmp_path: Path) -> None:
    write_exr(tmp_path / "map.exr", np.full((2, 2, 3), 0.5, np.float32))
    path, rng = tmp_path / "stage.usda", random.Random(seed)
    drawn, refused = 0, list[str]()
    for turn in range(ROUNDS):
        text = STAGE
        for place in sorted(rng.sample(PLACES, rng.choice((1, 1, 2, 3))), key=lambda m: -m.start()):
            text = text[: place.start()] + rng.choice(STRANGE) + text[place.end() :]
        path.write_text(text)
        try:
            scene = load_usd(path).scene
        except PureLightError as error:
            refused.append(str(error))
            continue
        drawn += 1
        if turn % 10 == 0:
            assert np.isfinite(picture(scene)).all(), path.read_text()
    assert drawn > ROUNDS // 2
    assert not [words for words in refused if "\n" in words]


CUBE = """
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 2, 3, 3, 2, 1, 0]
    point3f[] points = [(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]"""
INSTANCES = """
def Xform "There" ( instanceable = true
    prepend references = </Group>
)
{
    double3 xformOp:translate = (1, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
def Xform "Nowhere" ( instanceable = true
    prepend references = </Group>
)
{
    double3 xformOp:translate = (inf, 0, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
class Xform "Group"
{
    def Sphere "Ball"
    {
    }
}
"""


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("there", ["1", "inf"])
@pytest.mark.parametrize("kind", ["Sphere", "Mesh"])
def test_an_instance_that_is_nowhere_is_left_out(there: str, kind: str, tmp_path: Path) -> None:
    """Also where there is no other one."""
    inside = "" if kind == "Sphere" else CUBE
    text = INSTANCES.replace("(1, 0, 0)", f"({there}, 0, 0)").replace("Sphere", kind)
    path = tmp_path / "stage.usda"
    path.write_text(HEADER + CAMERA + text.replace("    {\n    }", f"    {{{inside}\n    }}"))
    found = load_usd(path)
    nowhere = ["/Nowhere"] if there == "1" else ["/There", "/Nowhere"]
    assert [note.split(":")[0] for note in found.notes] == nowhere
    assert len(found.scene.shapes()) == (there == "1")
    assert np.isfinite(picture(found.scene)).all()


ODD = """
def DistantLight "Sun"
{
    float inputs:angle = inf
}
def Cylinder "Disk"
{
    double height = 0
}
def Cube "Inside_out"
{
    double size = -2
    custom double radius = 0
}
def Sphere "Dot"
{
    double radius = 0
}
"""


def test_odd_sizes_and_angles(tmp_path: Path) -> None:
    path = tmp_path / "stage.usda"
    path.write_text(HEADER + CAMERA + ODD)
    found = load_usd(path)
    assert [note.split(":")[0] for note in found.notes] == ["/Sun", "/Dot"]
    assert len(found.scene.shapes()) == 2
