"""Zones of directions of equal solid angle: rows by the cosine to Z, columns by azimuth.

Zone i * columns + j spans the cosines of the angle to -Z from 1 - 2 i / rows down by 2 / rows, and
azimuths from 2 pi j / columns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def zone_of(direction: NDArray[np.floating], rows: int, columns: int) -> NDArray[np.int64]:
    """The zone of each unit vector: [N, 3] -> [N]."""
    x, y, z = direction.astype(np.float64).T
    row = np.clip(((1 + z) / 2 * rows).astype(np.int64), 0, rows - 1)
    column = (np.arctan2(y, x) / (2 * np.pi) % 1 * columns).astype(np.int64) % columns
    return row * columns + column


def fibonacci_lattice(count: int) -> NDArray[np.float64]:
    """Directions that are even all around, each for the same solid angle: [count, 3].

    A Fibonacci lattice; zones are long and narrow at the poles.
    """
    k = np.arange(count) + 0.5
    z, phi = 1 - 2 * k / count, np.pi * (1 + np.sqrt(5)) * k
    sine = np.sqrt(1 - z * z)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], 1)


def zone_middles(rows: int, columns: int) -> NDArray[np.float64]:
    """The direction in the middle of each zone: [rows * columns, 3]."""
    z = (np.arange(rows) + 0.5) / rows * 2 - 1
    phi = (np.arange(columns) + 0.5) / columns * 2 * np.pi
    z, phi = (g.ravel() for g in np.meshgrid(z, phi, indexing="ij"))
    sine = np.sqrt(1 - z**2)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), z], 1)
