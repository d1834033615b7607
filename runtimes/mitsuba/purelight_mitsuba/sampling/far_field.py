"""The far field of a lamp: what its IES file says about the directions in which light leaves."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError

VERTICAL, HORIZONTAL = 181, 145  # Nodes of the regular table, both ends included.
HEADER = 13  # Numbers before the angles.
TYPE_C = 1


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
        """Reads IES LM-63 text.

        Arguments:
            name: What to call the lamp in errors.

        Raises:
            PureLightError: If it is not type C without tilt, or not what it says.
        """
        _, tilt, rest = text.decode("ascii", "replace").partition("TILT=NONE")
        if not tilt:
            raise PureLightError(f"{name}: its photometry has a TILT, which is not supported")
        try:
            numbers = np.array([float(word) for word in re.split(r"[\s,]+", rest) if word])
            vertical, horizontal, table = _parts(numbers, int(numbers[3]), int(numbers[4]))
        except (ValueError, IndexError) as error:
            raise PureLightError(f"{name}: its photometry is not IES LM-63 text") from error
        if numbers[5] != TYPE_C:
            raise PureLightError(f"{name}: its photometry is not of type C")
        return FarField(_normalised(_regular(vertical, *_around(horizontal, table))))


def _parts(
    numbers: np.ndarray, rows: int, planes: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertical angles [V], horizontal angles [H] and candela [H, V]."""
    ends = HEADER + np.cumsum([rows, planes, rows * planes])
    vertical, horizontal, candela = np.split(numbers[: ends[-1]], [HEADER, *ends[:-1]])[1:]
    for angles in (vertical, horizontal):
        if not (len(angles) and (np.diff(angles) > 0).all()):
            raise ValueError
    return vertical, horizontal, candela.reshape(planes, rows)


def _around(horizontal: np.ndarray, table: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Completes the planes of a symmetric lamp to the whole circle."""
    if len(horizontal) == 1:
        return np.array([0.0, 360.0]), np.repeat(table, 2, 0)
    for end in (90, 180):
        if horizontal[-1] == end:
            horizontal = np.concatenate([horizontal, 2 * end - horizontal[-2::-1]])
            table = np.concatenate([table, table[-2::-1]])
    return horizontal, table


def _regular(vertical: np.ndarray, horizontal: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Interpolates a table at the regular nodes; dark beyond its vertical angles."""
    v, h = np.linspace(0, 180, VERTICAL), np.linspace(0, 360, HORIZONTAL)
    rows = np.array([np.interp(v, vertical, row, left=0, right=0) for row in table])
    return np.array([np.interp(h, horizontal, column) for column in rows.T]).T


def _normalised(values: np.ndarray) -> np.ndarray:
    angle = np.linspace(0, np.pi, VERTICAL)
    step = angle[1]
    weight = 2 * np.sin(angle) * (1 - np.cos(step)) / step  # Of a hat over sin.
    weight[[0, -1]] = 1 - np.sin(step) / step
    total = 2 * np.pi * float(values[:-1].mean(0) @ weight)
    return values / total if total > 0 else values
