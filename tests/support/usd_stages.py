"""Small USD stages as text, and what is seen and lit on them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from purelight_mitsuba.usd_scene import UsdScene, load_usd

HEADER = '#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = "Z"\n)\n'
CAMERA = """
def Camera "Camera"
{
    float focalLength = 20
    float horizontalAperture = 20
    float verticalAperture = 20
    float2 clippingRange = (0.01, 100)
    double3 xformOp:translate = (0, 0, 4)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
LIGHT = """
def {kind} "Light"
{{
    {values}
    matrix4d xformOp:transform = ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), {place} )
    uniform token[] xformOpOrder = ["xformOp:transform"]
}}
"""


def stage(folder: Path, *prims: str, camera: str = CAMERA) -> Path:
    path = folder / "scene.usda"
    path.write_text(HEADER + camera + "".join(prims))
    return path


def loaded(folder: Path, *prims: str) -> UsdScene:
    return load_usd(stage(folder, *prims))


FLOOR = """
def Plane "Floor"
{
    double width = 0.01
    double length = 0.01
    color3f[] primvars:displayColor = [(1, 1, 1)]
}
"""


TEXTURED = """
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
        asset inputs:file = @./{file}@
        {reader}
        float3 outputs:rgb
        float outputs:r
        float outputs:g
        float outputs:a
    }}
    def Shader "Moved"
    {{
        uniform token info:id = "UsdTransform2d"
        float2 inputs:in.connect = </M/Where.outputs:result>
        float2 inputs:translation = (0.5, 0)
        float2 outputs:result
    }}
    def Shader "Where"
    {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "picture"
        float2 outputs:result
    }}
}}
def Mesh "Floor" ( prepend apiSchemas = ["MaterialBindingAPI"] )
{{
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)]
    texCoord2f[] primvars:{name} = {uv} ( interpolation = "vertex" )
    rel material:binding = </M>
}}
"""
UPRIGHT = "[(0, 0), (1, 0), (1, 1), (0, 1)]"
RAW = 'token inputs:sourceColorSpace = "raw"\n'


def textured(
    inputs: str, reader: str = "", *, file: str = "map.exr", name: str = "st", uv: str = UPRIGHT
) -> str:
    """A square of a material with these inputs, and what may feed them: the texture T.

    Arguments:
        reader: Further inputs of the texture.
        name, uv: Of the primvar with the square's coordinates.
    """
    return TEXTURED.format(inputs=inputs, reader=reader, file=file, name=name, uv=uv)


def irradiance(folder: Path, light: str) -> np.ndarray:
    """Of a white floor at the origin, facing +Z, by light sampling."""
    view = mi.ScalarTransform4f().look_at([0, 0, 1e-3], [0, 0, 0], [0, 1, 0])
    eye = mi.load_dict({
        "type": "orthographic",
        "to_world": view @ mi.ScalarTransform4f().scale([1e-4, 1e-4, 1]),
        "near_clip": 1e-5,
        "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
    })  # fmt: skip
    scene, direct = loaded(folder, FLOOR, light).scene, mi.load_dict({"type": "direct"})
    image = mi.render(scene, sensor=eye, integrator=direct, spp=1 << 14)
    return np.pi * np.array(image).ravel()[:3]


def first_hit(scene: mi.Scene, x: float, y: float) -> Any:
    """What the camera sees at a place of the picture; (0, 0) is its upper left corner."""
    ray, _ = scene.sensors()[0].sample_ray(0, 0.5, mi.Point2f(x, y), mi.Point2f(0.5, 0.5))
    return scene.ray_intersect(mi.Ray3f(ray))
