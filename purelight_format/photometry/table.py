"""Luminous intensity on a grid of directions.

Angles follow LM-63 type C in the luminaire frame: vertical 0 is nadir (-Z), 180 is +Z; horizontal
0 is +X, 90 is +Y.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class IntensityTable:
    """Luminous intensity, linear between its nodes.

    Arguments:
        vertical: [V] degrees, rising.
        horizontal: [H] degrees, rising: 0 .. 360 with both ends, a half or a quarter of that for a
            lamp with mirror planes, or just one for a lamp of revolution.
        candela: [H, V].
    """

    vertical: np.ndarray
    horizontal: np.ndarray
    candela: np.ndarray

    def resampled(self, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
        """Intensity [H', V'] at the nodes of another grid; dark beyond the vertical angles."""
        around, planes = self._whole_circle()
        rows = np.array([np.interp(vertical, self.vertical, p, left=0, right=0) for p in planes])
        return np.array([np.interp(horizontal, around, column) for column in rows.T]).T

    def _whole_circle(self) -> tuple[np.ndarray, np.ndarray]:
        """Horizontal angles 0 .. 360 and their candela: mirror planes are undone."""
        horizontal, candela = self.horizontal, self.candela
        if len(horizontal) == 1:
            return np.array([0.0, 360.0]), np.repeat(candela, 2, 0)
        for end in (90, 180):
            if horizontal[-1] == end:
                horizontal = np.concatenate([horizontal, 2 * end - horizontal[-2::-1]])
                candela = np.concatenate([candela, candela[-2::-1]])
        return horizontal, candela


def node_solid_angle(vertical: np.ndarray) -> np.ndarray:
    r"""Solid angle :math:`2\pi \int \Lambda_i \sin\theta\,d\theta` of each node's hat: [V] in sr.

    The hats are piecewise linear and sum to one, so the solid angles sum to 4 pi.

    Arguments:
        vertical: [V] degrees, 0 .. 180.
    """
    angle = np.radians(vertical)
    low, high, step = angle[:-1], angle[1:], np.diff(angle)
    mean = (np.sin(high) - np.sin(low)) / step
    area = np.zeros(len(angle))
    area[:-1] += np.cos(low) - mean
    area[1:] += mean - np.cos(high)
    return 2 * np.pi * area
