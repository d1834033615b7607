"""Angles of photometric tables as they come."""

from __future__ import annotations

import numpy as np

from purelight_format.errors import PureLightError

LARGEST = 1000.0  # Degrees.


def rising(
    angle: np.ndarray, rows: np.ndarray, kind: str, name: str
) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Angles [N] and their rows [N, ...] in rising order, each once, and notes about repairs.

    Raises:
        PureLightError: They are no angles, or vertical ones are all the same.
    """
    if not len(angle) or (np.abs(angle) > LARGEST).any():
        raise PureLightError(f"{name}: its {kind} angles are none")
    notes = []
    if (np.diff(angle) <= 0).any():
        angle, first = np.unique(angle, return_index=True)
        rows = rows[first]
        notes.append(f"{kind} angles are put in order; of equal ones the first counts")
    if kind == "vertical" and len(angle) < 2:
        raise PureLightError(f"{name}: its vertical angles are all the same")
    return angle, rows, notes
