"""Materials and meshes of a lamp's USD asset, for renderers that read no bundle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_format.members.finishes import NONE, Finish
from purelight_format.members.surface import Surface
from purelight_format.usd.numbers_text import number, quoted, tuple_text, tuples

BINDING = 'prepend apiSchemas = ["MaterialBindingAPI"]'
FAMILY = """        uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
"""
DIFFUSING = 0.5  # What light that a body spreads adds to its colour in a preview.


@dataclass(frozen=True)
class KeptPart:
    """A part of a lamp that is no part of its networks, in the luminaire frame.

    Arguments:
        positions: [V, 3] in metres.
        triangles: [T, 3].
        normals: [V, 3] unit normals, None where it is flat.
    """

    name: str
    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    normals: NDArray[np.float32] | None
    finish: Finish


def material_text(finish: Finish, path: str) -> str:
    """A finish as a `UsdPreviewSurface`.

    Arguments:
        path: of the material's prim, two levels below the layer.
    """
    name = path.rpartition("/")[2]
    spread = finish.spread * (1 - finish.opacity)
    color = np.array(finish.base_color) + finish.scattered_ahead + finish.scattered_back
    color += DIFFUSING * spread
    return f"""    def Material "{name}"
    {{
        token outputs:surface.connect = <{path}/surface.outputs:surface>

        def Shader "surface"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = {tuple_text(np.clip(color, 0, 1))}
            float inputs:ior = {number(finish.ior)}
            float inputs:metallic = {number(finish.metalness)}
            float inputs:opacity = {number(finish.opacity + spread)}
            float inputs:roughness = {number(finish.roughness)}
            token outputs:surface
        }}
    }}
"""


def subset_texts(surface: Surface, root: str) -> str:
    """Which triangles have which material: that of the side that has one, the front if both."""
    if surface.finish is None:
        return ""
    front, back = surface.finish.T
    index = np.where(front == NONE, back, front)
    return FAMILY + "".join(
        f"""
        def GeomSubset "finish_{k}" (
            {BINDING}
        )
        {{
            uniform token elementType = "face"
            uniform token familyName = "materialBind"
            int[] indices = [{", ".join(map(str, np.flatnonzero(index == k).tolist()))}]
            rel material:binding = <{root}/finish_{k}>
        }}
"""
        for k in np.unique(index[index != NONE]).tolist()
    )


def kept_texts(parts: Sequence[KeptPart], root: str) -> str:
    """Meshes of kept parts, with their materials, as children of a scope."""
    if not parts:
        return ""
    inner = "".join(_part(part, k, f"{root}/kept") for k, part in enumerate(parts))
    indented = "".join(f"    {line}" if line.strip() else line for line in inner.splitlines(True))
    return f'\n    def Scope "kept"\n    {{\n{indented}    }}\n'


def _part(part: KeptPart, index: int, root: str) -> str:
    extent = tuples(np.stack((part.positions.min(0), part.positions.max(0))))
    normals = ""
    if part.normals is not None:
        normals = f"""
        normal3f[] normals = {tuples(part.normals)} (
            interpolation = "vertex"
        )"""
    return f"""    def Mesh "part_{index}" (
        {BINDING}
        displayName = {quoted(part.name)}
    )
    {{
        uniform bool doubleSided = 1
        float3[] extent = {extent}
        int[] faceVertexCounts = [{", ".join(["3"] * len(part.triangles))}]
        int[] faceVertexIndices = [{", ".join(map(str, part.triangles.ravel().tolist()))}]
        rel material:binding = <{root}/material_{index}>{normals}
        point3f[] points = {tuples(part.positions)}
        uniform token subdivisionScheme = "none"
    }}

{material_text(part.finish, f"{root}/material_{index}")}"""
