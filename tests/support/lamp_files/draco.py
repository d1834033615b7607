"""A glTF file with its meshes compressed by Draco."""

from __future__ import annotations

from typing import Any

import DracoPy
import numpy as np

from purelight_import.read.gltf.draco import DRACO
from tests.support.lamp_files.glb import COMPONENTS, TYPES, Glb

WIDTHS = {name: width for width, name in TYPES.items()}
KINDS = {number: kind for kind, number in COMPONENTS.items()}
NAMES = {0: "POSITION", 1: "NORMAL", 3: "TEXCOORD_0"}  # by Draco's type of an attribute


def packed(made: Glb, bits: int = 16) -> Glb:
    """The same file; its old buffer views stay, and no accessor names them any more."""
    made.json["extensionsRequired"] = [DRACO]
    for mesh in made.json["meshes"]:
        for primitive in mesh["primitives"]:
            _pack(made, primitive, bits)
    return made


def _pack(made: Glb, primitive: dict[str, Any], bits: int) -> None:
    named = primitive["attributes"]
    values = {name: _values(made, named[name]) for name in NAMES.values() if name in named}
    data = DracoPy.encode(
        values["POSITION"], _values(made, primitive["indices"]).reshape(-1, 3),
        quantization_bits=bits, preserve_order=True,
        normals=values.get("NORMAL"), tex_coord=values.get("TEXCOORD_0"),
    )  # fmt: skip
    numbers = {NAMES[a["attribute_type"]]: a["unique_id"] for a in DracoPy.decode(data).attributes}
    for accessor in (*(named[name] for name in values), primitive["indices"]):
        made.json["accessors"][accessor].pop("bufferView", None)
    primitive["extensions"] = {DRACO: {"bufferView": made.view(data), "attributes": numbers}}


def _values(made: Glb, accessor: int) -> Any:
    about = made.json["accessors"][accessor]
    view = made.json["bufferViews"][about["bufferView"]]
    kind = np.dtype(f"<{KINDS[about['componentType']]}")
    count = about["count"] * WIDTHS[about["type"]]
    values = np.frombuffer(made.data, kind, count, view["byteOffset"]).reshape(about["count"], -1)
    return values.astype(np.float64 if values.dtype.kind == "f" else np.uint32)
