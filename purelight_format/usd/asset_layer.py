"""The luminaire as a USD asset: a layer that any renderer opens, with our API on its root prim."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.members.manifest import Manifest
from purelight_format.members.surface import Surface
from purelight_format.usd.guide import guide
from purelight_format.usd.luminaires import LuminairePrim, luminaires
from purelight_format.usd_schema import SCHEMA

__all__ = ["LuminairePrim", "Paths", "identifier", "layer_text", "luminaires"]


@dataclass(frozen=True)
class Paths:
    """The files a layer names, each beginning with ./ .

    Arguments:
        bundle: the bundle, or the manifest inside the package that holds the layer.
        digest: SHA-256 of manifest.json; empty inside a bundle, whose manifest lists the layer.
        photometry: the IES file, empty if there is none.
        layer: the layer itself.
    """

    bundle: str
    layer: str
    digest: str = ""
    photometry: str = ""


def identifier(name: str) -> str:
    """A name as a USD prim name, which is also a file name: lower case, digits and _."""
    plain = re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")[:40]
    return plain if plain[:1].isalpha() else f"lamp_{plain}".rstrip("_")


def layer_text(manifest: Manifest, surface: Surface, paths: Paths) -> str:
    """Writes the layer: root Xform with the API, a fallback SphereLight, a guide to the surface.

    The text is the same for the same arguments, and needs no USD library.

    Arguments:
        manifest: sphere, flux and name.
        surface: the exit surface.
        paths: the files to name.

    Returns:
        A complete .usda file.
    """
    name = identifier(manifest.name)
    center, radius = manifest.bounding_sphere.center, manifest.bounding_sphere.radius
    positions, triangles = guide(surface)
    hint = _extent(np.asarray(surface.positions, np.float32).reshape(-1, 3))
    digest = f"\n    uniform string purelight:bundleDigest = {_quoted(paths.digest)}"
    return f"""#usda 1.0
(
    defaultPrim = "{name}"
    metersPerUnit = 1
    upAxis = "Z"
)

def Xform "{name}" (
    prepend apiSchemas = ["{SCHEMA}", "GeomModelAPI"]
    assetInfo = {{
        asset identifier = @{paths.layer}@
        string name = {_quoted(manifest.name)}
        string version = {_quoted(manifest.format_version)}
    }}
    kind = "component"
)
{{
    float3[] extentsHint = {hint}
    uniform float4 purelight:boundingSphere = {_tuple((*center, radius))}
    uniform asset purelight:bundle = @{paths.bundle}@{digest if paths.digest else ""}
    float purelight:dimmer = 1
    rel purelight:exitSurface = </{name}/exit_surface>
    rel purelight:fallback = </{name}/fallback>
    uniform float3 purelight:flux = {_tuple(manifest.flux)}
    uniform token purelight:fluxUnit = "watt"
    uniform token purelight:formatVersion = {_quoted(manifest.format_version)}

{_fallback(manifest, surface, paths)}
    def Mesh "exit_surface"
    {{
        uniform bool doubleSided = 1
        float3[] extent = {_extent(positions)}
        int[] faceVertexCounts = [{", ".join(["3"] * len(triangles))}]
        int[] faceVertexIndices = [{", ".join(map(str, triangles.ravel().tolist()))}]
        point3f[] points = {_tuples(positions)}
        uniform token purpose = "guide"
        uniform token subdivisionScheme = "none"
    }}
}}
"""


def _fallback(manifest: Manifest, surface: Surface, paths: Paths) -> str:
    r"""A Lambertian sphere of the lamp's flux, :math:`\Phi = 4 \pi^2 r^2 L` per channel.

    Its area is that of the exit surface where that is smaller than the bounding sphere, so that
    it does not reach into a ceiling. Every value is written: readers ignore fallbacks.
    """
    bounding = manifest.bounding_sphere.radius
    radius = min(bounding, math.sqrt(float(surface.area().sum()) / (4 * math.pi))) or bounding
    largest = max(manifest.flux)
    color = [flux / largest for flux in manifest.flux] if largest else [1.0] * 3
    shaping = ""
    if paths.photometry:
        shaping = f"""
        asset inputs:shaping:ies:file = @{paths.photometry}@
        bool inputs:shaping:ies:normalize = 1"""
    return f"""    def SphereLight "fallback" (
        prepend apiSchemas = ["ShapingAPI"]
    )
    {{
        color3f inputs:color = {_tuple(color)} (
            colorSpace = "lin_rec709_scene"
        )
        float inputs:exposure = 0
        float inputs:intensity = {_number(largest / (4 * math.pi**2 * radius**2))}
        bool inputs:normalize = 0
        float inputs:radius = {_number(radius)}{shaping}
        double3 xformOp:translate = {_tuple(manifest.bounding_sphere.center)}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""


def _quoted(text: str) -> str:
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _number(value: float) -> str:
    """The shortest text that reads back as the same float32."""
    return str(np.float32(value))


def _extent(positions: np.ndarray) -> str:
    """The box around positions [V, 3]."""
    return _tuples(np.stack((positions.min(0), positions.max(0))))


def _tuple(values: Any) -> str:
    return f"({', '.join(map(_number, values))})"


def _tuples(rows: np.ndarray) -> str:
    return f"[{', '.join(_tuple(row) for row in rows)}]"
