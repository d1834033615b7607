"""Where a lamp hangs: rotation, uniform scale and translation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError

TOLERANCE = 1e-4  # Relative; a scene file gives matrices with about six digits.


@dataclass(frozen=True, eq=False)
class Placement:
    """world = scale · rotation · local + translation.

    Arguments:
        rotation: [3, 3] float64, proper.
        scale: Positive.
        translation: [3] float64, metres.
    """

    rotation: np.ndarray
    scale: float
    translation: np.ndarray

    @staticmethod
    def of(matrix: np.ndarray, name: str) -> Placement:
        """Takes a 4 x 4 matrix apart.

        Arguments:
            matrix: [4, 4], local to world.
            name: What to call the lamp in errors.

        Raises:
            PureLightError: If the matrix mirrors, shears, projects, or scales unevenly.
        """
        matrix = np.asarray(matrix, np.float64).reshape(4, 4)
        linear, translation = matrix[:3, :3], matrix[:3, 3]
        if not np.isfinite(matrix).all() or not np.allclose(matrix[3], [0, 0, 0, 1]):
            raise PureLightError(f"{name}: to_world is not a finite affine transform")
        volume = np.linalg.det(linear)
        if volume <= 0:
            raise PureLightError(
                f"{name}: to_world mirrors or flattens the lamp; use rotations, translations and "
                "a positive uniform scale"
            )
        scale = float(np.cbrt(volume))
        rotation = linear / scale
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=TOLERANCE):
            raise PureLightError(
                f"{name}: to_world shears or scales the axes differently; the light of a lamp is "
                "only known up to a uniform scale"
            )
        return Placement(rotation, scale, translation)

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Moves points [N, 3] from the luminaire frame to the world."""
        return self.scale * (points @ self.rotation.T) + self.translation
