"""What a photometric file says of a lamp, whatever its format."""

from __future__ import annotations

from dataclasses import dataclass

from purelight_format.photometry.opening import POINT, Opening
from purelight_format.photometry.table import IntensityTable


@dataclass(frozen=True)
class LampPhotometry:
    """Absolute luminous intensities and what goes with them.

    Arguments:
        name: of the luminaire.
        table: intensity in candela of the luminaire with its lamps.
        opening: the luminous part.
        lamp_lumens: flux of the bare lamps, if the file tells it.
        watts: input power, 0 if the file does not tell it.
        notes: what a reader should know: assumptions, and repairs of the file.
        lengthwise: plane C of the luminaire's length: 90, as EULUMDAT has it, or 0, as LM-63.
    """

    name: str
    table: IntensityTable
    opening: Opening = POINT
    lamp_lumens: float | None = None
    watts: float = 0.0
    notes: tuple[str, ...] = ()
    lengthwise: float = 90.0
