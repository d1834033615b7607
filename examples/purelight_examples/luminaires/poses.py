"""Where copies of a shape stand: matrices [4, 4], and the copies as one mesh."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
import trimesh
from numpy.typing import NDArray

Floats = NDArray[np.float64]
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def shift(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Floats:
    """The matrix that moves, in metres."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def turn(axis: str, degrees: float) -> Floats:
    """The matrix that turns about x, y or z through the origin."""
    matrix: Floats = trimesh.transformations.rotation_matrix(np.radians(degrees), AXES[axis])
    return matrix


def around(count: int, radius: float, z: float = 0.0, start: float = 0.0) -> list[Floats]:
    """Poses on a circle about Z, each with its X axis pointing outwards.

    Arguments:
        start: of the first, in parts of the angle between two.
    """
    step = 360.0 / count
    return [turn("z", step * (k + start)) @ shift(radius, 0.0, z) for k in range(count)]


def copies(mesh: trimesh.Trimesh, poses: Iterable[Floats]) -> trimesh.Trimesh:
    """A mesh at each of the poses, as one mesh."""
    return joined([mesh.copy().apply_transform(pose) for pose in poses])


def joined(meshes: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Several meshes as one."""
    return trimesh.util.concatenate(list(meshes))
