"""From a file's unit and axes to metres with +Z up, the same for all that is taken of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.frame import UNITS, Frame, guess_unit, unit
from purelight_import.model.lamp import Lamp, Part


def placed(
    lamp: Lamp, kept: tuple[Part, ...], units: str | None, up: str | None
) -> tuple[Lamp, tuple[Part, ...]]:
    """A lamp and what is kept apart from it, in metres with +Z up.

    Arguments:
        units, up: as said by a person, None if not.

    Raises:
        PureLightError: the file states no unit and none fits, or the lamp is too large for any.
    """
    whole = replace(lamp, parts=lamp.parts + kept)
    size = float(np.ptp(whole.bounds, axis=0).max())
    frame = _frame(whole, size, units, up)
    if not size * frame.metres <= limits.COORDINATE:
        raise PureLightError(f"the lamp is {size * frame.metres:.3g} m across; say --units")
    return replace(lamp, frame=frame).placed(), Lamp("", kept, (), frame).placed().parts


def _frame(lamp: Lamp, size: float, units: str | None, said_up: str | None) -> Frame:
    """Unit and up axis as said, as the file states, or as its size suggests."""
    frame = lamp.frame
    metres, up = frame.metres, said_up or frame.up
    if units is not None:
        metres = unit(units)
    elif not frame.unit_known:
        name = guess_unit(size)
        metres = UNITS[name]
        lamp.notes(f"the file states no unit: taken as {name}, so that the lamp is "
                   f"{size * metres:.3g} m across (--units)")  # fmt: skip
    if said_up is None and not frame.up_known:
        lamp.notes(f"the file does not say what is up: taken as {up.upper()} (--up)")
    return Frame(metres, up)
