"""Triangles of a part."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles over vertices, wound so that their front is on the side of `normals`.

    Arguments:
        positions: [V, 3].
        triangles: [T, 3] indices of vertices.
        normals: [V, 3] unit normals of smooth surfaces; flat faces if None.
        uv: [V, 2] texture coordinates whose origin is the upper left corner of the picture.
    """

    positions: Floats
    triangles: NDArray[np.uint32]
    normals: NDArray[Any] | None = None
    uv: NDArray[Any] | None = None

    @property
    def corners(self) -> Floats:
        """Positions of the corners: [T, 3, 3]."""
        return self.positions[self.triangles]

    @property
    def cross(self) -> Floats:
        """Normals of the triangles, twice as long as the area: [T, 3]."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> Floats:
        """Area of each triangle: [T]."""
        result: Floats = 0.5 * np.linalg.norm(self.cross, axis=1)
        return result

    @property
    def area(self) -> float:
        return float(self.areas.sum())

    @property
    def bounds(self) -> Floats:
        """Least and largest coordinates: [2, 3]."""
        return np.stack((self.positions.min(0), self.positions.max(0)))

    def moved(self, matrix: Floats) -> Mesh:
        """Under a transform [4, 4]; a mirror's winding is turned back."""
        linear = matrix[:3, :3]
        normals = self.normals
        if normals is not None:
            normals = _unit(normals @ np.linalg.pinv(linear))
        mirror = np.linalg.det(linear) < 0
        return Mesh(
            self.positions @ linear.T + matrix[:3, 3],
            np.ascontiguousarray(self.triangles[:, ::-1]) if mirror else self.triangles,
            normals, self.uv,
        )  # fmt: skip

    def turned(self, which: NDArray[np.bool_] | None = None) -> Mesh:
        """With front and back changed over, of all triangles or of those where a mask is true.

        Vertices that turned and other triangles share must not have normals.
        """
        which = np.ones(len(self.triangles), bool) if which is None else which
        triangles = self.triangles.copy()
        triangles[which] = triangles[which][:, ::-1]
        normals = None if self.normals is None else self.normals.copy()
        if normals is not None:
            touched = np.unique(self.triangles[which])
            normals[touched] = -normals[touched]
        return replace(self, triangles=triangles, normals=normals)

    def welded(self) -> NDArray[np.int64]:
        """Triangles [T, 3] by places: corners within a millionth of the size are one."""
        size = np.ptp(self.positions, axis=0).max() or 1.0
        grid = np.round((self.positions - self.positions.min(0)) / (1e-6 * size)).astype(np.int64)
        _, place = np.unique(grid, axis=0, return_inverse=True)
        return place.reshape(-1)[self.triangles]

    def proper(self) -> Mesh | None:
        """Without triangles that have no area or a corner that is no number; None if none is left.

        Vertices without a triangle are dropped.
        """
        finite = np.isfinite(self.positions).sum(1) == 3
        keep = finite[self.triangles].sum(1) == 3
        with np.errstate(over="ignore", invalid="ignore"):  # Areas beyond numbers are some too.
            keep[keep] = ~(replace(self, triangles=self.triangles[keep]).areas <= 0)
        if not keep.any():
            return None
        left = self.only(keep)
        sound = (a if a is None or np.isfinite(a).all() else None for a in (left.normals, left.uv))
        return Mesh(left.positions, left.triangles, *sound)

    def only(self, which: NDArray[Any]) -> Mesh:
        """Of some triangles, given by a mask or by indices, and of their vertices alone."""
        used, triangles = np.unique(self.triangles[which], return_inverse=True)
        normals, uv = (None if a is None else a[used] for a in (self.normals, self.uv))
        faces = triangles.reshape(-1, 3).astype(np.uint32)
        return Mesh(self.positions[used], faces, normals, uv)


def joined(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one; flat where some have normals and some none."""
    starts = np.cumsum([0, *(len(m.positions) for m in meshes[:-1])])
    return Mesh(
        np.concatenate([m.positions for m in meshes]),
        np.concatenate([m.triangles + np.uint32(s) for m, s in zip(meshes, starts, strict=True)]),
        _all([m.normals for m in meshes]), _all([m.uv for m in meshes]),
    )  # fmt: skip


def _all(arrays: list[NDArray[Any] | None]) -> NDArray[Any] | None:
    there = [a for a in arrays if a is not None]
    return np.concatenate(there) if len(there) == len(arrays) else None


def _unit(vectors: NDArray[Any]) -> NDArray[Any]:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)
