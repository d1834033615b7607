"""OBJ and its material library, written by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.support.lamp_files.model import Piece, y_up


def write(folder: Path, pieces: list[Piece], scale: float = 100.0) -> Path:
    """Pieces in units of which a metre has so many, +Y up; emission in W/(m² sr)."""
    lines, count = ["mtllib shelf_light.mtl"], 1
    for piece in pieces:
        lines += [f"o {piece.name}", f"usemtl {piece.material}"]
        lines += ["v {:.9g} {:.9g} {:.9g}".format(*v) for v in scale * y_up(piece.mesh.vertices)]
        lines += ["f {} {} {}".format(*(f + count)) for f in np.asarray(piece.mesh.faces)]
        count += len(piece.mesh.vertices)
    (folder / "shelf_light.mtl").write_text("\n".join(_material(p) for p in pieces))
    path = folder / "shelf_light.obj"
    path.write_text("\n".join(lines) + "\n")
    return path


def _material(piece: Piece) -> str:
    words = piece.words
    lines = [f"newmtl {piece.material}", "Kd {} {} {}".format(*words["base"])]
    if words.get("transmission"):
        lines += ["illum 7", "d 0.1", f"Ni {words['ior']}", "Tf 1 1 1"]
    if "metallic" in words:
        lines += [f"Pm {words['metallic']}", f"Pr {words['roughness']}"]
    if piece.radiance is not None:
        lines.append("Ke {} {} {}".format(*piece.radiance))
    return "\n".join(lines)
