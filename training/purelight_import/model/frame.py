"""The frame of a file, and the way from it to metres with +Z up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError

UNITS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
GUESSES = ("m", "cm", "mm", "in")
PLAUSIBLE, USUAL = (0.04, 2.0), 0.3  # metres, the largest extent of most lamps
# Rows are the luminaire's axes in the file's: rotations that bring each axis up
UP = {
    "z": np.eye(3),
    "y": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]),
    "x": np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]]),
    "-z": np.array([[1.0, 0, 0], [0, -1, 0], [0, 0, -1]]),
    "-y": np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
    "-x": np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
}


@dataclass(frozen=True)
class Frame:
    """Arguments:
    metres: length of the unit.
    up: the axis that points up, a key of `UP`.
    unit_known, up_known: whether the file states them.
    """

    metres: float = 1.0
    up: str = "z"
    unit_known: bool = True
    up_known: bool = True

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Transform [4, 4] to metres with +Z up."""
        result = np.eye(4)
        result[:3, :3] = self.metres * UP[self.up]
        return result


def unit(text: str) -> float:
    """Metres of a unit's name, or of a number of metres.

    Raises:
        ValueError: it is neither.
    """
    if text.lower() in UNITS:
        return UNITS[text.lower()]
    value = float(text)
    if not 1e-9 < value < 1e9:
        raise ValueError
    return value


def guess_unit(size: float) -> str:
    """The unit in which a lamp of an extent would be of a size nearest the usual one.

    Inches are taken where no other unit gives a plausible size.

    Raises:
        PureLightError: there is none.
    """
    fit = [n for n in GUESSES if PLAUSIBLE[0] <= size * UNITS[n] <= PLAUSIBLE[1]]
    metric = [name for name in fit if name != "in"]
    if fit:
        return min(metric or fit, key=lambda name: abs(math.log(size * UNITS[name] / USUAL)))
    raise PureLightError(
        f"the file states no unit, and {size:.3g} of none would be a lamp; say it with --units "
        f"({', '.join(UNITS)}, or metres as a number)"
    )
