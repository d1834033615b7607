"""Triangles with values at their corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Corners:
    """Triangles with values at their corners, wound against the clock as seen from outside.

    Arguments:
        position: [T, 3, 3].
        face: [T] the polygon each came from.
        normal: [T, 3, 3] unit normals, or None.
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

    def flipped(self) -> Corners:
        """The same triangles, wound the other way round."""
        rest = (None if a is None else a[:, ::-1] for a in (self.normal, self.uv))
        return Corners(self.position[:, ::-1], self.face, *rest)

    def under(self, at: np.ndarray) -> Corners:
        """The triangles under a transform [4, 4] for column vectors; outside stays outside."""
        normal = None if self.normal is None else directions(at, self.normal)
        moved = Corners(points(at, self.position), self.face, normal, self.uv)
        return moved.flipped() if np.linalg.det(at[:3, :3]) < 0 else moved

    def mirrored(self) -> np.ndarray:
        """Where the picture on the triangles is a mirror image: [T] bool."""
        if self.uv is None:
            return np.zeros(len(self.face), bool)
        (ax, ay), (bx, by) = (np.moveaxis(self.uv[:, k] - self.uv[:, 0], -1, 0) for k in (1, 2))
        result: np.ndarray = ax * by - ay * bx < 0
        return result


def points(at: np.ndarray, position: np.ndarray) -> np.ndarray:
    """Points [..., 3] under a transform."""
    return position @ at[:3, :3].T + at[:3, 3]


def directions(at: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Unit normals [..., 3] under a transform, by its inverse transpose."""
    turned = normals @ np.linalg.pinv(at[:3, :3])
    return turned / np.maximum(np.linalg.norm(turned, axis=-1, keepdims=True), 1e-30)


def fans(counts: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polygon [T] and corners [T, 3] (into the index list) of a fan of triangles per polygon.

    Arguments:
        counts: [F] corners of each polygon; fewer than three make no triangle.
    """
    triangles = np.maximum(counts - 2, 0)
    face = np.repeat(np.arange(len(counts)), triangles)
    start = (np.cumsum(counts) - counts)[face]
    second = np.arange(len(face)) - (np.cumsum(triangles) - triangles)[face]
    return face, np.stack([start, start + second + 1, start + second + 2], 1)


def at_corners(
    data: tuple[np.ndarray, str] | None, corner: np.ndarray, vertex: np.ndarray, face: np.ndarray
) -> np.ndarray | None:
    """Values at corners [C, ...] by their interpolation; None if their number is wrong.

    Arguments:
        data: Values and their interpolation, as UsdGeom names it.
        corner, vertex, face: [C] the number of each corner, its vertex and its polygon.
    """
    if data is None:
        return None
    value, how = data
    index = {
        "faceVarying": corner,
        "vertex": vertex,
        "varying": vertex,
        "uniform": face,
        "constant": np.zeros_like(corner),
    }.get(how)
    valid = index is not None and len(value) > (index.max() if index.size else 0)
    return value[index] if valid else None
