"""Meshes as files."""

from __future__ import annotations

import numpy as np

from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.placement import Placement

GRID = 2.0**-20  # what positions are rounded to, in unit lengths: machines differ by less


def ply(form: Mesh, placement: Placement) -> bytes:
    """A mesh as binary PLY: float32 positions, texture coordinates where there are any."""
    vertices = np.round(form.triangles.vertices / GRID) * GRID
    columns = [placement.points(vertices)]
    names = ["x", "y", "z"]
    if form.uv is not None:
        columns.append(form.uv)
        names += ["u", "v"]
    faces = np.empty(len(form.triangles.faces), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, form.triangles.faces
    header = [
        "ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}",
        *(f"property float {name}" for name in names), f"element face {len(faces)}",
        "property list uchar int vertex_indices", "end_header\n",
    ]  # fmt: skip
    data = np.concatenate(columns, 1).astype("<f4")
    return "\n".join(header).encode() + data.tobytes() + faces.tobytes()
