"""The far field of a lamp: what its IES file says about the directions in which light leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.photometry.reader import read_ies
from purelight_format.photometry.table import IntensityTable

VERTICAL, HORIZONTAL = 181, 145  # Nodes of the regular table, both ends included.


@dataclass(frozen=True)
class FarField:
    """Relative intensity, linear between its nodes.

    Arguments:
        values: [HORIZONTAL, VERTICAL] float64 in 1/sr, whose integral over all directions is one.
            Vertical angles run from -Z to +Z, horizontal ones from +X by +Y all around.
    """

    values: np.ndarray

    @staticmethod
    def of(text: bytes, name: str) -> FarField:
        """Reads IES LM-63 text; for arguments and errors see `read_ies`."""
        values = on_grid(read_ies(text, name))
        total = integral(values)
        return FarField(values / total if total > 0 else values)


def on_grid(table: IntensityTable) -> np.ndarray:
    """Intensity at the nodes of the regular table: [HORIZONTAL, VERTICAL]."""
    return table.resampled(np.linspace(0, 180, VERTICAL), np.linspace(0, 360, HORIZONTAL))


def integral(values: np.ndarray) -> float:
    """Of values at the nodes over all directions."""
    angle = np.linspace(0, np.pi, VERTICAL)
    step = angle[1]
    weight = 2 * np.sin(angle) * (1 - np.cos(step)) / step  # Of a hat over sin.
    weight[[0, -1]] = 1 - np.sin(step) / step
    return 2 * np.pi * float(values[:-1].mean(0) @ weight)
