"""Luminous intensity on a grid of directions.

Angles follow LM-63 type C in the luminaire frame: vertical 0 is nadir (-Z), 180 is +Z; horizontal
0 is +X, 90 is +Y. The planes C of EULUMDAT are the same angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from purelight_format.photometry.symmetry import whole_circle


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

    @cached_property
    def whole(self) -> tuple[np.ndarray, np.ndarray]:
        """Horizontal angles 0 .. 360 and their candela: mirror planes are undone."""
        return whole_circle(self.horizontal, self.candela)

    @property
    def flux(self) -> float:
        """Integral over all directions of the interpolated table, in lm."""
        around, planes = self.whole
        weight = np.zeros(len(around))
        weight[:-1] += np.diff(around) / 720
        weight[1:] += np.diff(around) / 720
        return float(weight @ planes @ node_solid_angle(self.vertical))

    def resampled(self, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
        """Intensity [H', V'] at the nodes of another grid; dark beyond the vertical angles."""
        around, planes = self.whole
        rows = np.array([np.interp(vertical, self.vertical, p, left=0, right=0) for p in planes])
        return np.array([np.interp(horizontal, around, column) for column in rows.T]).T

    def at(self, vertical: np.ndarray, horizontal: np.ndarray) -> np.ndarray:
        """Intensity [N] in directions [N] in degrees; dark beyond the vertical angles."""
        around, planes = self.whole
        value = bilinear(around, self.vertical, planes, horizontal % 360, vertical)
        inside = (vertical >= self.vertical[0]) & (vertical <= self.vertical[-1])
        return np.where(inside, value, 0.0)

    def scaled(self, factor: float) -> IntensityTable:
        """The same table with so many times the intensity."""
        return IntensityTable(self.vertical, self.horizontal, self.candela * factor)


def bilinear(
    rows: np.ndarray, columns: np.ndarray, values: np.ndarray, row: np.ndarray, column: np.ndarray
) -> np.ndarray:
    """Values [R, C] between nodes [R] and [C], at positions [N] and [N]; constant beyond: [N]."""
    i, across = _place(rows, row)
    j, along = _place(columns, column)
    k, m = np.minimum(i + 1, len(rows) - 1), np.minimum(j + 1, len(columns) - 1)
    low = values[i, j] * (1 - along) + values[i, m] * along
    high = values[k, j] * (1 - along) + values[k, m] * along
    return low * (1 - across) + high * across


def _place(nodes: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The interval [N] that positions [N] lie in, and where in it, from 0 to 1."""
    low = np.clip(np.searchsorted(nodes, at, side="right") - 1, 0, max(len(nodes) - 2, 0))
    high = np.minimum(low + 1, len(nodes) - 1)
    step = np.where(high > low, nodes[high] - nodes[low], 1.0)
    return low, np.clip((at - nodes[low]) / step, 0, 1)


def node_solid_angle(vertical: np.ndarray) -> np.ndarray:
    r"""Solid angle :math:`2\pi \int \Lambda_i \sin\theta\,d\theta` of each node's hat: [V] in sr.

    The hats are piecewise linear and sum to one between the first and the last node: over 0 .. 180
    degrees the solid angles sum to 4 pi.

    Arguments:
        vertical: [V] degrees, rising.
    """
    angle = np.radians(vertical)
    low, high, step = angle[:-1], angle[1:], np.diff(angle)
    mean = (np.sin(high) - np.sin(low)) / step
    area = np.zeros(len(angle))
    area[:-1] += np.cos(low) - mean
    area[1:] += mean - np.cos(high)
    return 2 * np.pi * area
