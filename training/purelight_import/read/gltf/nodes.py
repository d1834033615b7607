"""The hierarchy of nodes, and where each puts its content."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_import.model import limits
from purelight_import.read.gltf.accessors import array
from purelight_import.read.gltf.document import Document, Object

Floats = NDArray[np.float64]
INSTANCING = "EXT_mesh_gpu_instancing"


@dataclass(frozen=True)
class Placed:
    """A node in its place.

    Arguments:
        index: of the node.
        to_world: [4, 4].
        path: names of the nodes above it, and its own.
    """

    index: int
    node: Object
    to_world: Floats
    path: tuple[str, ...]


def placed_nodes(document: Document) -> Iterator[Placed]:
    """All nodes of the file's scene, or of its first one.

    Raises:
        ValueError: the nodes are no trees, or too deep.
    """
    stack: list[tuple[Any, Floats, tuple[str, ...]]] = [
        (root, np.eye(4), ()) for root in reversed(_roots(document))
    ]
    seen: set[int] = set()
    while stack:
        index, parent, above = stack.pop()
        node = document.item("nodes", index)
        if index in seen or len(above) > limits.DEPTH or len(seen) > limits.NODES:
            raise ValueError("its nodes are no trees, or too many")
        seen.add(index)
        to_world = parent @ local(node)
        if not np.isfinite(to_world).all():
            raise ValueError("a node's transform is no number")
        path = (*above, str(node.get("name", "")))
        yield Placed(index, node, to_world, path)
        stack += [(child, to_world, path) for child in reversed(list(node.get("children", [])))]


def _roots(document: Document) -> list[Any]:
    if document.json.get("scenes"):
        return list(document.item("scenes", document.json.get("scene", 0)).get("nodes", []))
    children = {c for node in document.json.get("nodes", []) for c in node.get("children", [])}
    return [i for i in range(len(document.json.get("nodes", []))) if i not in children]


def local(node: Object) -> Floats:
    """A node's own transform [4, 4]: its matrix, or translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    return trs(
        np.array(node.get("translation", (0, 0, 0)), np.float64),
        np.array(node.get("rotation", (0, 0, 0, 1)), np.float64),
        np.array(node.get("scale", (1, 1, 1)), np.float64),
    )


def trs(translation: Floats, rotation: Floats, scale: Floats) -> Floats:
    """Transform [4, 4] of a translation [3], a quaternion [4] (x, y, z, w) and a scale [3]."""
    x, y, z, w = rotation / (np.linalg.norm(rotation) or 1.0)
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    result = np.eye(4)
    result[:3, :3] = turn * scale.reshape(3)
    result[:3, 3] = translation.reshape(3)
    return result


def instances(document: Document, placed: Placed) -> list[Floats]:
    """Where the mesh of a node stands: once, or as often as it is instanced."""
    extension = placed.node.get("extensions", {}).get(INSTANCING)
    if not extension:
        return [placed.to_world]
    named = extension["attributes"]
    columns = {
        key: array(document, named[key]).astype(np.float64)
        for key in ("TRANSLATION", "ROTATION", "SCALE") if key in named
    }  # fmt: skip
    count = min((len(c) for c in columns.values()), default=0)
    if count > limits.NODES:
        raise ValueError("a mesh is instanced too often")
    moves = columns.get("TRANSLATION", np.zeros((count, 3)))
    turns = columns.get("ROTATION", np.tile([0.0, 0, 0, 1], (count, 1)))
    sizes = columns.get("SCALE", np.ones((count, 3)))
    return [placed.to_world @ trs(moves[i], turns[i], sizes[i]) for i in range(count)]
