"""A USD stage, written by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.support.lamp_files.model import Piece, y_up

HEADER = (
    '#usda 1.0\n(\n    defaultPrim = "ShelfLight"\n    metersPerUnit = {}\n    upAxis = "{}"\n)\n'
)
MESH = """
    def Mesh "{name}" ( prepend apiSchemas = ["MaterialBindingAPI"] )
    {{
        uniform token subdivisionScheme = "none"
        int[] faceVertexCounts = {counts}
        int[] faceVertexIndices = {indices}
        point3f[] points = {points}
        rel material:binding = </ShelfLight/{material}>
    }}
    def Material "{material}"
    {{
        token outputs:surface.connect = </ShelfLight/{material}/S.outputs:surface>
        def Shader "S"
        {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = {base}
            float inputs:metallic = {metallic}
            float inputs:roughness = {roughness}
            float inputs:ior = {ior}
            float inputs:opacity = {opacity}
            color3f inputs:emissiveColor = {radiance}
            token outputs:surface
        }}
    }}
"""


def text(pieces: list[Piece], scale: float = 100.0, up: str = "Y", more: str = "") -> str:
    """Pieces in units of which a metre has so many; emission in W/(m² sr)."""
    body = "".join(_mesh(piece, scale, up) for piece in pieces)
    return HEADER.format(1 / scale, up) + f'def Xform "ShelfLight"\n{{\n{body}{more}\n}}\n'


def write(folder: Path, pieces: list[Piece], name: str = "shelf_light.usda", **more: Any) -> Path:
    path = folder / name
    path.write_text(text(pieces, **more))
    return path


def _mesh(piece: Piece, scale: float, up: str) -> str:
    points = piece.mesh.vertices if up == "Z" else y_up(piece.mesh.vertices)
    words = piece.words
    return MESH.format(
        name=piece.name, material=piece.material.replace(" ", "_"),
        counts=[3] * len(piece.mesh.faces), indices=piece.mesh.faces.ravel().tolist(),
        points=[tuple(p) for p in (scale * points).tolist()], base=words["base"],
        metallic=words.get("metallic", 0.0), roughness=words.get("roughness", 1.0),
        ior=words.get("ior", 1.5), opacity=1 - words.get("transmission", 0.0),
        radiance=piece.radiance or (0, 0, 0),
    )  # fmt: skip
