"""Triangles of a mesh's primitives, with morph targets and skins as they stand."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_import.model.mesh import Mesh
from purelight_import.read.gltf.accessors import array
from purelight_import.read.gltf.document import Document, Object
from purelight_import.read.gltf.draco import unpack

Floats = NDArray[np.float64]
TRIANGLES, STRIP, FAN = 4, 5, 6


def primitive_mesh(
    document: Document, primitive: Object, uv_set: int, weights: list[float], joints: Floats | None
) -> Mesh | None:
    """The triangles of a primitive; None where it has points or lines.

    Arguments:
        uv_set: which texture coordinates its material asks for.
        weights: of morph targets.
        joints: [J, 4, 4] transforms of the skin's joints, or None.

    Raises:
        ValueError: it is broken.
    """
    mode = primitive.get("mode", TRIANGLES)
    if mode not in (TRIANGLES, STRIP, FAN):
        return None
    named = primitive["attributes"]
    if "bufferView" not in document.item("accessors", named["POSITION"]):
        mode = TRIANGLES if unpack(document, primitive) else mode  # which Draco makes of strips
    positions = _morphed(document, primitive, "POSITION", weights)
    normals = _morphed(document, primitive, "NORMAL", weights) if "NORMAL" in named else None
    uv = None
    if f"TEXCOORD_{uv_set}" in named:
        uv = array(document, named[f"TEXCOORD_{uv_set}"]).astype(np.float64)
    if joints is not None and "JOINTS_0" in named and "WEIGHTS_0" in named:
        positions, normals = _skinned(document, named, joints, positions, normals)
    triangles = _triangles(document, primitive, mode, len(positions))
    for values in (normals, uv):
        if values is not None and len(values) != len(positions):
            raise ValueError("a primitive's attributes are of different lengths")
    return Mesh(positions, triangles, normals, None if uv is None else uv[:, :2])


def _triangles(
    document: Document, primitive: Object, mode: int, vertices: int
) -> NDArray[np.uint32]:
    """Corners [T, 3] of a primitive."""
    if "indices" in primitive:
        index = array(document, primitive["indices"])[:, 0].astype(np.int64)
        if len(index) and index.max() >= vertices:
            raise ValueError("a primitive names vertices that are not there")
    else:
        index = np.arange(vertices)
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3).astype(np.uint32)
    step = np.arange(max(len(index) - 2, 0))
    if mode == FAN:
        corners = np.stack((step + 1, step + 2, np.zeros_like(step)), 1)
    else:  # Every other triangle of a strip is wound the other way.
        odd = step % 2
        corners = np.stack((step, step + 1 + odd, step + 2 - odd), 1)
    return index[corners].reshape(-1, 3).astype(np.uint32)


def _morphed(document: Document, primitive: Object, name: str, weights: list[float]) -> Floats:
    """An attribute [V, 3] with the mesh's morph targets added as they stand."""
    values = array(document, primitive["attributes"][name]).astype(np.float64)
    for weight, target in zip(weights, primitive.get("targets", []), strict=False):
        if weight and name in target:
            values = values + weight * array(document, target[name])
    if values.shape[1] != 3:
        raise ValueError(f"{name} is no vector")
    return values


def _skinned(
    document: Document, named: Object, joints: Floats, positions: Floats, normals: Floats | None
) -> tuple[Floats, Floats | None]:
    """Positions and normals where a skin's joints put them, by linear blending."""
    index = array(document, named["JOINTS_0"]).astype(np.int64)
    weight = array(document, named["WEIGHTS_0"]).astype(np.float64)
    if len(index) and (index.max() >= len(joints) or len(weight) != len(index)):
        raise ValueError("a skin names joints that are not there")
    weight /= np.maximum(weight.sum(1, keepdims=True), 1e-9)
    matrix = np.einsum("vk,vkij->vij", weight, joints[index])
    moved = np.einsum("vij,vj->vi", matrix[:, :3, :3], positions) + matrix[:, :3, 3]
    if normals is not None:
        normals = np.einsum("vij,vj->vi", matrix[:, :3, :3], normals)
    return moved, normals


def joint_matrices(document: Document, skin: Any, to_world: dict[int, Floats]) -> Floats:
    """Transforms [J, 4, 4] of a skin's joints from the mesh to the world."""
    about = document.item("skins", skin)
    world = np.stack([to_world[joint] for joint in about["joints"]])
    if "inverseBindMatrices" not in about:
        return world
    inverse = array(document, about["inverseBindMatrices"]).astype(np.float64)
    bound: Floats = world @ inverse[: len(world)].reshape(-1, 4, 4).transpose(0, 2, 1)
    return bound
