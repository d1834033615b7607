"""Where things are: a lamp in its scene, and a part in its lamp."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Placement:
    """Where and how large a lamp stands: x -> scale * rotation x + offset, in metres.

    Arguments:
        rotation: [3, 3].
    """

    scale: float = 1.0
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def matrix(self) -> Floats:
        result = np.eye(4)
        result[:3, :3], result[:3, 3] = self.scale * self.rotation, self.offset
        return result

    def points(self, points: Floats) -> Floats:
        """Points [N, 3] in metres, by sums that are the same on any machine."""
        return apply(self.matrix, points)

    def directions(self, directions: Floats) -> Floats:
        """Directions [N, 3], turned alone."""
        turn = np.eye(4)
        turn[:3, :3] = self.rotation
        return apply(turn, directions)


def shift(x: float = 0.0, y: float = 0.0, z: float = 0.0, scale: float = 1.0) -> Floats:
    """The matrix that scales, then moves."""
    matrix = np.diag([scale, scale, scale, 1.0])
    matrix[:3, 3] = x, y, z
    return matrix


def turn(axis: str, angle: float) -> Floats:
    """The matrix that turns about x, y or z by radians."""
    i = "xyz".index(axis)
    j, k = (i + 1) % 3, (i + 2) % 3
    matrix = np.eye(4)
    matrix[[j, k], [j, k]] = np.cos(angle)
    matrix[k, j] = np.sin(angle)
    matrix[j, k] = -matrix[k, j]
    return matrix


def apply(matrix: Floats, points: Floats) -> Floats:
    """Points [N, 3] by a matrix, without the sums of a library for linear algebra."""
    p = np.asarray(points, np.float64)
    columns = [
        matrix[i, 0] * p[:, 0] + matrix[i, 1] * p[:, 1] + matrix[i, 2] * p[:, 2] + matrix[i, 3]
        for i in range(3)
    ]
    return np.stack(columns, 1)
