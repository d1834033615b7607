"""Meshes that Draco compressed (KHR_draco_mesh_compression), unpacked by its own decoder."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.notes import Notes
from purelight_import.read import isolated
from purelight_import.read.gltf.document import Document, Object, open_document

DRACO = "KHR_draco_mesh_compression"


@dataclass(frozen=True)
class Unpacked:
    """A compressed mesh as it was.

    Arguments:
        triangles: [T, 3] vertices of each.
        attributes: [V, width] by the number that Draco gives each.
    """

    triangles: NDArray[np.uint32]
    attributes: dict[int, NDArray[Any]]


def unpack(document: Document, primitive: Object) -> bool:
    """Gives a primitive's accessors what Draco holds for them; whether it holds anything.

    Raises:
        PureLightError: the decoder is not installed.
        ValueError: the data is broken, or is not what the primitive says.
    """
    packed = primitive.get("extensions", {}).get(DRACO)
    if packed is None:
        return False
    if not document.packed:
        document.packed = isolated.call(f"{__name__}:unpacked", document.path)
    found = document.packed[packed["bufferView"]]
    for name, number in packed["attributes"].items():
        document.arrays[primitive["attributes"][name]] = found.attributes[number]
    document.arrays[primitive["indices"]] = found.triangles.reshape(-1, 1)
    return True


def unpacked(path: Path) -> dict[int, Unpacked]:
    """All compressed meshes of a file, by their buffer views. For a process of its own."""
    document = open_document(path, Notes())
    return {view: _decoded(document.view(view)) for view in sorted(set(_views(document)))}


def _views(document: Document) -> Iterator[int]:
    for mesh in document.json.get("meshes", []):
        for primitive in mesh["primitives"]:
            if DRACO in primitive.get("extensions", {}):
                yield primitive["extensions"][DRACO]["bufferView"]


def _decoded(data: bytes) -> Unpacked:
    try:
        import DracoPy
    except ImportError:
        raise PureLightError(
            "its meshes are compressed (Draco); pip install DracoPy, or export the lamp without "
            "compression"
        ) from None
    mesh = DracoPy.decode(data)
    triangles = getattr(mesh, "faces", None)
    if triangles is None:
        raise ValueError("Draco holds points and no mesh")
    if len(triangles) > limits.TRIANGLES or len(mesh.points) > limits.VERTICES:
        raise PureLightError(f"a mesh has {len(triangles):,} triangles, too many to read")
    attributes = {a["unique_id"]: np.asarray(a["data"]) for a in mesh.attributes}
    return Unpacked(np.asarray(triangles, np.uint32), attributes)
