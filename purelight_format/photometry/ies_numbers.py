"""The numbers of an IES LM-63 file: which they are, whatever its commas mean."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.goniometer import TYPE_A, TYPE_C
from purelight_format.photometry.text import numbers

HEADER = 13  # Numbers before the angles.
NODES = 1 << 20  # Of a table; whole degrees all around are 65,000.


def table_numbers(text: str, tilt: str, name: str) -> tuple[np.ndarray, list[str]]:
    """The numbers after TILT: as many as the file says that there are.

    Commas separate, or are decimal points. Both are tried, since decimal commas that separate give
    too many numbers, which looks like a table with something behind it. The count decides.

    Arguments:
        text: what follows the line TILT=.
        tilt: what that line says; at INCLUDE, the lamp's behaviour under tilt comes first.
        name: What to call the lamp in errors.

    Returns:
        The numbers from the header on, and notes about repairs.

    Raises:
        PureLightError: no way of reading gives a table.
    """
    ways = dict.fromkeys((text, text.replace(",", ".")))  # One, where there are no commas.
    given, *_ = readings = [_reading(way, tilt) for way in ways]
    fitting = [reading for reading in readings if not reading.problem]
    if not fitting:
        raise PureLightError(f"{name}: not IES LM-63 text: {readings[-1].problem}")
    chosen = next((reading for reading in fitting if reading.exact), fitting[0])
    return chosen.values, [] if chosen is given else ["commas are taken as decimal points"]


@dataclass(frozen=True)
class _Reading:
    """One way of reading the numbers.

    Arguments:
        values: without the lamp's behaviour under tilt.
        problem: why they cannot be a table; empty if they can.
    """

    values: np.ndarray
    problem: str

    @property
    def exact(self) -> bool:
        """Whether there are as many numbers as the header announces, and none behind them."""
        return not self.problem and len(self.values) == _announced(self.values)


def _reading(text: str, tilt: str) -> _Reading:
    """The numbers of a text whose commas separate."""
    values = numbers(text, HEADER + 4 * NODES)
    if tilt == "INCLUDE":
        behind = _behind_tilt(values)
        if behind is None:
            return _Reading(values, "no angles follow TILT=INCLUDE")
        values = behind
    return _Reading(values, _problem(values))


def _behind_tilt(values: np.ndarray) -> np.ndarray | None:
    """What follows the lamp's geometry, and the count of its angles, angles and factors."""
    count = values[1] if len(values) > 1 else -1.0
    if not (count.is_integer() and 0 <= count < len(values)):
        return None
    return values[2 + 2 * int(count) :]


def _announced(values: np.ndarray) -> float:
    """How many numbers a header says that there are, itself among them."""
    rows, planes = float(values[3]), float(values[4])
    return HEADER + rows + planes + rows * planes


def _problem(values: np.ndarray) -> str:
    """Why the numbers cannot be a table, or nothing."""
    if len(values) < HEADER:
        return f"{len(values)} numbers after TILT= where {HEADER} come before the angles"
    rows, planes, kind = values[3], values[4], values[5]
    if not (rows.is_integer() and planes.is_integer() and rows >= 2 and planes >= 1):
        return f"{rows:g} vertical and {planes:g} horizontal angles"
    if rows * planes > NODES:
        return f"a table of {rows * planes:g} intensities, where {NODES} may be"
    if kind not in range(TYPE_C, TYPE_A + 1):
        return f"photometric type {kind:g}, where 1 (C), 2 (B) and 3 (A) are known"
    wanted = _announced(values)
    if len(values) < wanted:
        return f"{len(values)} numbers, where its header announces {wanted:g}"
    return ""
