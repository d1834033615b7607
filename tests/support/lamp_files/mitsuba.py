"""Scenes of Mitsuba, of today and of old."""

from __future__ import annotations

from pathlib import Path

from tests.support.lamp_files.model import Piece

NEW = {"face": "face_normals", "ior": "int_ior", "reflectance": "specular_reflectance"}
OLD = {"face": "faceNormals", "ior": "intIOR", "reflectance": "specularReflectance"}


def write(folder: Path, pieces: list[Piece], version: str = "3.0.0", more: str = "") -> Path:
    """Pieces in metres with +Z up, as PLY meshes."""
    names = NEW if version.startswith("3") else OLD
    shapes = []
    for piece in pieces:
        (folder / f"{piece.name}.ply").write_bytes(piece.mesh.export(file_type="ply"))
        shapes.append(_shape(piece, names))
    path = folder / "shelf_light.xml"
    body = "\n".join(shapes)
    path.write_text(f'<scene version="{version}">\n{more}\n{body}\n</scene>\n')
    return path


def _shape(piece: Piece, names: dict[str, str]) -> str:
    emitter = ""
    if piece.radiance is not None:
        value = ", ".join(map(str, piece.radiance))
        emitter = f'<emitter type="area"><rgb name="radiance" value="{value}"/></emitter>'
    return (
        f'<shape type="ply" id="{piece.name}">'
        f'<string name="filename" value="{piece.name}.ply"/>'
        f'<boolean name="{names["face"]}" value="true"/>{_bsdf(piece, names)}{emitter}</shape>'
    )


def _bsdf(piece: Piece, names: dict[str, str]) -> str:
    words = piece.words
    if words.get("transmission"):
        inner = f'<float name="{names["ior"]}" value="{words["ior"]}"/>'
        return f'<bsdf type="dielectric" id="{piece.material}">{inner}</bsdf>'
    color = ", ".join(map(str, words["base"]))
    if words.get("metallic"):
        inner = (
            f'<string name="material" value="none"/><float name="alpha" value="0.16"/>'
            f'<rgb name="{names["reflectance"]}" value="{color}"/>'
        )
        return f'<bsdf type="roughconductor" id="{piece.material}">{inner}</bsdf>'
    inner = f'<rgb name="reflectance" value="{color}"/>'
    return f'<bsdf type="diffuse" id="{piece.material}">{inner}</bsdf>'
