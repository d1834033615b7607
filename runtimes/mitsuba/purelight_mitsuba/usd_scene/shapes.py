"""Meshes and solids of a stage as Mitsuba meshes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
import trimesh

from purelight_mitsuba.usd_scene.materials import Materials
from purelight_mitsuba.usd_scene.values import Values

SOLIDS = ("Sphere", "Cube", "Cylinder", "Cone", "Capsule", "Plane")
Note = Callable[[Any, str], None]


@dataclass(frozen=True)
class Corners:
    """Triangles with values at their corners.

    Arguments:
        position: [T, 3, 3] in the world.
        face: [T] the polygon each came from.
        normal: [T, 3, 3] in the world, or None.
        uv: [T, 3, 2], or None.
    """

    position: np.ndarray
    face: np.ndarray
    normal: np.ndarray | None = None
    uv: np.ndarray | None = None

    def take(self, chosen: np.ndarray) -> Corners:
        """The triangles where a mask [T] is true."""
        rest = (None if a is None else a[chosen] for a in (self.normal, self.uv))
        return Corners(self.position[chosen], self.face[chosen], *rest)


def mesh(prim: Any, values: Values, materials: Materials, note: Note) -> Iterator[mi.Mesh]:
    """A `UsdGeom.Mesh`, one Mitsuba mesh per material."""
    if values.get(prim, "subdivisionScheme", "catmullClark") != "none":
        note(prim, "subdivision surface rendered as its control mesh")
    corners = mesh_corners(prim, values)
    if corners is None:
        note(prim, "the mesh has no valid faces and was left out")
        return
    rest = np.ones(len(corners.face), bool)
    for subset, faces in materials.subsets(prim):
        part = np.isin(corners.face, faces)
        if (part & rest).any():
            yield _mesh(prim, corners.take(part & rest), materials, subset)
        rest &= ~part
    if rest.any():
        yield _mesh(prim, corners.take(rest), materials, prim)


def solid(prim: Any, values: Values, materials: Materials, note: Note) -> Iterator[mi.Mesh]:
    """A sphere, cube, cylinder, cone, capsule or plane, as a fine mesh."""
    yield _mesh(prim, solid_corners(prim, values), materials, prim)


def solid_corners(prim: Any, values: Values) -> Corners:
    """Triangles of a sphere, cube, cylinder, cone, capsule or plane, in the world."""
    shape = _solid(prim, values)
    at = values.to_world(prim)
    position = _points(at, shape.vertices)[shape.faces]
    smooth = str(prim.GetTypeName()) in ("Sphere", "Capsule")
    normal = _directions(at, shape.vertex_normals)[shape.faces] if smooth else None
    return _outward(Corners(position, np.arange(len(shape.faces)), normal), at)


def _solid(prim: Any, values: Values) -> trimesh.Trimesh:
    """A solid in its own frame, by the meaning of its USD attributes."""
    kind, radius = str(prim.GetTypeName()), values.number(prim, "radius", 1.0)
    height = values.number(prim, "height", 1.0 if kind == "Capsule" else 2.0)
    if kind == "Sphere":
        return trimesh.creation.icosphere(subdivisions=5, radius=radius)
    if kind == "Cube":
        return trimesh.creation.box(extents=[values.number(prim, "size", 2.0)] * 3)
    if kind == "Plane":
        x, y = values.number(prim, "width", 2.0) / 2, values.number(prim, "length", 2.0) / 2
        shape = trimesh.Trimesh([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]],
                                [[0, 1, 2], [0, 2, 3]], process=False)  # fmt: skip
    elif kind == "Cylinder":
        shape = trimesh.creation.cylinder(radius=radius, height=height, sections=128)
    elif kind == "Cone":
        shape = trimesh.creation.cone(radius=radius, height=height, sections=128)
        shape.apply_translation([0, 0, -height / 2])
    else:
        shape = trimesh.creation.capsule(height=height, radius=radius, count=[64, 64])
        shape.apply_translation(-shape.bounds.mean(0))
    axis = str(values.get(prim, "axis", "Z"))
    turn = {"X": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "Y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]]}
    matrix = np.eye(4)
    matrix[:3, :3] = turn.get(axis, np.eye(3))
    shape.apply_transform(matrix)
    return shape


def mesh_corners(prim: Any, values: Values) -> Corners | None:
    """A mesh's polygons cut into fans of triangles; None where its indices are not valid."""
    counts = np.asarray(values.get(prim, "faceVertexCounts", []), np.int64)
    indices = np.asarray(values.get(prim, "faceVertexIndices", []), np.int64)
    points = np.asarray(values.get(prim, "points", []), np.float64).reshape(-1, 3)
    holes = np.asarray(values.get(prim, "holeIndices", []), np.int64)
    whole = len(counts) and counts.min() >= 0 and counts.sum() == len(indices)
    if not whole or not len(indices) or not 0 <= indices.min() <= indices.max() < len(points):
        return None
    face, corner = _fans(counts)
    keep = ~np.isin(face, holes)
    face, corner = face[keep], corner[keep]
    at = values.to_world(prim)
    normal = _at_corners(_normals(prim, values), corner, indices, face)
    uv = _at_corners(values.primvar(prim, "st"), corner, indices, face)
    corners = Corners(
        _points(at, points)[indices[corner]],
        face,
        None if normal is None else _directions(at, normal),
        None if uv is None or uv.shape[-1] != 2 else uv,
    )
    flipped = values.get(prim, "orientation", "rightHanded") == "leftHanded"
    return _outward(corners, at, flipped=flipped)


def _fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polygon [T] and corners [T, 3] (into the index list) of a fan of triangles per polygon."""
    triangles = np.maximum(counts - 2, 0)
    face = np.repeat(np.arange(len(counts)), triangles)
    start = (np.cumsum(counts) - counts)[face]
    second = np.arange(len(face)) - (np.cumsum(triangles) - triangles)[face]
    return face, np.stack([start, start + second + 1, start + second + 2], 1)


def _normals(prim: Any, values: Values) -> tuple[np.ndarray, str] | None:
    """Authored normals, as a primvar or as the mesh's attribute."""
    from pxr import UsdGeom

    found = values.primvar(prim, "normals")
    raw = values.get(prim, "normals")
    if found is None and raw is not None and len(raw):
        found = np.asarray(raw, np.float32), str(UsdGeom.Mesh(prim).GetNormalsInterpolation())
    return found


def _at_corners(
    data: tuple[np.ndarray, str] | None, corner: np.ndarray, indices: np.ndarray, face: np.ndarray
) -> np.ndarray | None:
    """Values at the corners [T, 3, ...] by their interpolation; None if their number is wrong."""
    if data is None:
        return None
    value, how = data
    index = {
        "faceVarying": corner,
        "vertex": indices[corner],
        "varying": indices[corner],
        "uniform": np.repeat(face[:, None], 3, 1),
        "constant": np.zeros_like(corner),
    }.get(how)
    valid = index is not None and len(value) > (index.max() if index.size else 0)
    return value[index] if valid else None


def _points(at: np.ndarray, points: np.ndarray) -> np.ndarray:
    return points @ at[:3, :3].T + at[:3, 3]


def _directions(at: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Unit normals under a transform, by its inverse transpose."""
    turned = normals @ np.linalg.pinv(at[:3, :3])
    return turned / np.maximum(np.linalg.norm(turned, axis=-1, keepdims=True), 1e-30)


def _outward(corners: Corners, at: np.ndarray, *, flipped: bool = False) -> Corners:
    """Restores the winding where a reflection or a left-handed mesh turned it."""
    if (np.linalg.det(at[:3, :3]) < 0) == flipped:
        return corners
    arrays = (corners.normal, corners.uv)
    rest = (None if a is None else a[:, ::-1] for a in arrays)
    return Corners(corners.position[:, ::-1], corners.face, *rest)


def _mesh(prim: Any, corners: Corners, materials: Materials, bound: Any) -> mi.Mesh:
    """Triangles with the material of a prim or subset."""
    props = mi.Properties()
    props["bsdf"], emission = materials.bsdf(bound, prim)
    if emission is not None:
        props["emitter"] = emission
    if corners.normal is None:
        props["face_normals"] = True
    count = len(corners.face)
    result = mi.Mesh(
        str(prim.GetPath()), 3 * count, count, props,
        has_vertex_normals=corners.normal is not None, has_vertex_texcoords=corners.uv is not None,
    )  # fmt: skip
    buffers = mi.traverse(result)
    buffers["vertex_positions"] = mi.Float(corners.position.astype(np.float32).ravel())
    buffers["faces"] = mi.UInt32(np.arange(3 * count, dtype=np.uint32))
    if corners.normal is not None:
        buffers["vertex_normals"] = mi.Float(corners.normal.astype(np.float32).ravel())
    if corners.uv is not None:
        buffers["vertex_texcoords"] = mi.Float(corners.uv.astype(np.float32).ravel())
    buffers.update()
    return result
