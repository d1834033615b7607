"""IES LM-63 text as a table."""

from __future__ import annotations

import re

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.table import IntensityTable

HEADER = 13  # Numbers before the angles.
FACTORS = [2, 10]  # Of them, on all intensities: candela multiplier and ballast factor.
TYPE_C = 1


def read_ies(text: bytes, name: str) -> IntensityTable:
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
        table = _table(numbers, int(numbers[3]), int(numbers[4]))
    except (ValueError, IndexError) as error:
        raise PureLightError(f"{name}: its photometry is not IES LM-63 text") from error
    if numbers[5] != TYPE_C:
        raise PureLightError(f"{name}: its photometry is not of type C")
    return table


def _table(numbers: np.ndarray, rows: int, planes: int) -> IntensityTable:
    ends = HEADER + np.cumsum([rows, planes, rows * planes])
    vertical, horizontal, candela = np.split(numbers[: ends[-1]], [HEADER, *ends[:-1]])[1:]
    for angles in (vertical, horizontal):
        if not (len(angles) and (np.diff(angles) > 0).all()):
            raise ValueError
    candela = candela * numbers[FACTORS].prod()
    return IntensityTable(vertical, horizontal, candela.reshape(planes, rows))
