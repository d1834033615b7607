"""A glTF file as a lamp."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_import.model.frame import Frame
from purelight_import.model.lamp import Lamp
from purelight_import.read.build import Builder
from purelight_import.read.gltf.document import COMPRESSED, Document, Object, open_document
from purelight_import.read.gltf.draco import DRACO
from purelight_import.read.gltf.lights import EXTENSION, add_light
from purelight_import.read.gltf.materials import TAKEN, UNTAKEN, Materials
from purelight_import.read.gltf.nodes import INSTANCING, Placed, instances, placed_nodes
from purelight_import.read.gltf.primitives import joint_matrices, primitive_mesh
from purelight_import.read.gltf.textures import BASIS, TRANSFORM, WEBP

KNOWN = {
    *TAKEN, *UNTAKEN, *COMPRESSED, DRACO, INSTANCING, EXTENSION, TRANSFORM, WEBP, BASIS,
    "KHR_mesh_quantization",
}  # fmt: skip


def read_gltf(path: Path) -> Lamp:
    """Reads the meshes, materials and lights of a file's scene.

    Raises:
        PureLightError: something about it cannot be taken, with the remedy.
        ValueError: it is broken; so are LookupError, TypeError and AttributeError.
    """
    builder = Builder()
    document = open_document(path, builder.notes)
    for name in document.json.get("extensionsRequired", []):
        if name not in KNOWN:
            builder.notes(f"the file needs {str(name)[:60]}, which is not taken")
    if document.json.get("animations"):
        builder.notes("animations are left out: the lamp is as it stands")
    nodes = list(placed_nodes(document))
    to_world = {placed.index: placed.to_world for placed in nodes}
    materials = Materials(document)
    for placed in nodes:
        add_light(document, placed, builder)
        if "mesh" in placed.node:
            _add_mesh(document, placed, materials, builder, to_world)
    frame = Frame(1.0, "y")
    return Lamp(
        _title(document), tuple(builder.parts), tuple(builder.points), frame, builder.notes,
        tuple(builder.room),
    )  # fmt: skip


def _add_mesh(
    document: Document, placed: Placed, materials: Materials, builder: Builder,
    to_world: dict[int, NDArray[np.float64]],
) -> None:  # fmt: skip
    """Adds the primitives of a node's mesh, as often as it is instanced."""
    about = document.item("meshes", placed.node["mesh"])
    mesh_name = str(about.get("name", ""))
    weights = list(placed.node.get("weights") or about.get("weights") or [])
    skinned = "skin" in placed.node
    joints = joint_matrices(document, placed.node["skin"], to_world) if skinned else None
    places = [np.eye(4)] if skinned else instances(document, placed)
    for primitive in about["primitives"]:
        surface = materials.surface(primitive.get("material"))
        mesh = primitive_mesh(document, primitive, surface.uv_set, weights, joints)
        if mesh is None:
            builder.notes("points and lines are left out", mesh_name or placed.path[-1])
            continue
        if "COLOR_0" in primitive["attributes"]:
            builder.notes("colours of vertices are left out", surface.material.name)
        builder.foresee(len(places) * len(mesh.triangles), len(places))
        for place in places:
            builder.add(
                placed.path[-1] or mesh_name or surface.material.name, mesh.moved(place),
                surface.material, (*placed.path, mesh_name), surface.radiance,
                double_sided=surface.double_sided,
            )  # fmt: skip


def _title(document: Document) -> str:
    """What the file calls its scene, if it does."""
    extras: Any = document.json["asset"].get("extras", {})
    title = extras.get("title") if isinstance(extras, dict) else None
    scenes: list[Object] = document.json.get("scenes", [])
    index = document.json.get("scene", 0)
    name = scenes[index].get("name", "") if 0 <= index < len(scenes) else ""
    return str(title or name or "")
