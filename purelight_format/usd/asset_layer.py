"""The luminaire as a USD asset: a layer that any renderer opens, with our API on its root prim."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from purelight_format.members.container import PART
from purelight_format.members.manifest import Manifest
from purelight_format.members.surface import Surface
from purelight_format.usd.appearance_text import (
    BINDING,
    KeptPart,
    kept_texts,
    material_text,
    subset_texts,
)
from purelight_format.usd.guide import guide
from purelight_format.usd.luminaires import LuminairePrim, luminaires
from purelight_format.usd.numbers_text import number as _number
from purelight_format.usd.numbers_text import quoted as _quoted
from purelight_format.usd.numbers_text import tuple_text as _tuple
from purelight_format.usd.numbers_text import tuples as _tuples
from purelight_format.usd_schema import SCHEMA

__all__ = ["LuminairePrim", "Paths", "identifier", "layer_text", "luminaires"]

LINKS = ("lightLink", "shadowLink")


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
    allowed = plain[:1].isalpha() and PART.fullmatch(plain)  # No device of Windows
    return plain if allowed else f"lamp_{plain}".rstrip("_")


def layer_text(
    manifest: Manifest, surface: Surface, paths: Paths, kept: Sequence[KeptPart] = ()
) -> str:
    """Writes the layer: root Xform with the API, a fallback SphereLight, the exit surface.

    A surface with finishes is a mesh with materials, for renderers that read no bundle; without, it
    is only a guide; a large one is shown coarser (`guide`). The text is the same for the same
    arguments, and needs no USD library.

    Arguments:
        manifest: sphere, flux, name and finishes.
        surface: the exit surface.
        paths: the files to name.
        kept: parts of the lamp that are ordinary geometry, for all renderers.

    Returns:
        A complete .usda file.
    """
    name = identifier(manifest.name)
    center, radius = manifest.bounding_sphere.center, manifest.bounding_sphere.radius
    shown, every = guide(surface), np.asarray(surface.positions, np.float32).reshape(-1, 3)
    bound = f" (\n        {BINDING}\n    )" if manifest.finishes else ""
    purpose = "" if manifest.finishes else '\n        uniform token purpose = "guide"'
    materials = "".join(
        f"\n{material_text(finish, f'/{name}/finish_{k}')}"
        for k, finish in enumerate(manifest.finishes)
    )
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
    float3[] extentsHint = {_extent(every)}
    uniform float4 purelight:boundingSphere = {_tuple((*center, radius))}
    uniform asset purelight:bundle = @{paths.bundle}@{digest if paths.digest else ""}
    float purelight:dimmer = 1
    rel purelight:exitSurface = </{name}/exit_surface>
    rel purelight:fallback = </{name}/fallback>
    uniform float3 purelight:flux = {_tuple(manifest.flux)}
    uniform token purelight:fluxUnit = "watt"
    uniform token purelight:formatVersion = {_quoted(manifest.format_version)}

{_fallback(manifest, surface, paths)}
    def Mesh "exit_surface"{bound}
    {{
        uniform bool doubleSided = 1
        float3[] extent = {_extent(shown.positions)}
        int[] faceVertexCounts = [{", ".join(["3"] * len(shown.triangles))}]
        int[] faceVertexIndices = [{", ".join(map(str, shown.triangles.ravel().tolist()))}]
        point3f[] points = {_tuples(shown.positions)}{purpose}
        uniform token subdivisionScheme = "none"
{subset_texts(shown, f"/{name}")}    }}
{materials}{kept_texts(kept, f"/{name}")}}}
"""


def _extent(positions: np.ndarray) -> str:
    """The box around positions [V, 3]."""
    return _tuples(np.stack((positions.min(0), positions.max(0))))


def _fallback(manifest: Manifest, surface: Surface, paths: Paths) -> str:
    r"""A Lambertian sphere of the lamp's flux, :math:`\Phi = 4 \pi^2 r^2 L` per channel.

    Its area is that of the exit surface where that is smaller than the bounding sphere, so that
    it does not reach into a ceiling. Every value is written: readers ignore fallbacks. The lamp's
    own body, where it can be seen, neither casts its shadow nor gets its light.
    """
    bounding = manifest.bounding_sphere.radius
    radius = min(bounding, math.sqrt(float(surface.area().sum()) / (4 * math.pi))) or bounding
    largest = max(manifest.flux)
    color = [flux / largest for flux in manifest.flux] if largest else [1.0] * 3
    shaping, name = "", identifier(manifest.name)
    links = "".join(f"""
        uniform token collection:{link}:expansionRule = "expandPrims"
        uniform bool collection:{link}:includeRoot = 1
        rel collection:{link}:excludes = </{name}/exit_surface>"""
        for link in (LINKS if manifest.finishes else ()))  # fmt: skip
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
        float inputs:radius = {_number(radius)}{shaping}{links}
        double3 xformOp:translate = {_tuple(manifest.bounding_sphere.center)}
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }}
"""
