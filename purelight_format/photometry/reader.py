"""IES LM-63 text of any edition, 1986 to 2019."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.goniometer import TYPE_C, as_type_c
from purelight_format.photometry.ies_numbers import HEADER, table_numbers
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.nodes import rising
from purelight_format.photometry.opening import Opening
from purelight_format.photometry.table import IntensityTable
from purelight_format.photometry.text import lines_of

TILT = re.compile(r"\s*TILT\s*=\s*(.*?)\s*", re.IGNORECASE)
KEYWORD = re.compile(r"\s*\[(\w+)\]\s*(.*)")
NEWER = re.compile(r"LM-63-20\d\d")  # Which give two diameters of what is round
UNUSED = re.compile(r"LM-63-(1995|20\d\d)")  # Whose 12th number is no factor any more
FEET, METRES = 0.3048, 1.0


def read_ies(text: bytes, name: str) -> IntensityTable:
    """The intensities of the photometry in a bundle: type C without tilt, angles rising.

    Arguments:
        name: What to call the lamp in errors.

    Raises:
        PureLightError: If it is something else, which `ies_photometry` may be able to read.
    """
    found = _Text.of(text, name)
    if found.tilt != "NONE":
        raise PureLightError(f"{name}: its photometry has a TILT, which is not supported")
    if found.kind != TYPE_C:
        raise PureLightError(f"{name}: its photometry is not of type C")
    lamp = found.photometry()
    if lamp.notes:
        raise PureLightError(f"{name}: its photometry is not IES LM-63 text: {lamp.notes[0]}")
    return lamp.table


def ies_photometry(data: bytes, name: str) -> LampPhotometry:
    """Reads IES LM-63 text as it comes.

    Candela are those of the luminaire with its lamps: the file's values times its multiplier and
    its ballast factor, and before 1995 times its ballast-lamp factor. How a lamp behaves when it is
    tilted (TILT) is not applied: the luminaire hangs as it was measured.

    Arguments:
        name: What to call the lamp in errors, and where the file does not name it.

    Raises:
        PureLightError: If it is not IES LM-63 text, or not what it says.
    """
    return _Text.of(data, name).photometry()


@dataclass(frozen=True)
class _Text:
    """The parts of a file.

    Arguments:
        name: see `ies_photometry`.
        called: name of the luminaire.
        tilt: NONE, INCLUDE or a file's name.
        values: what follows, without the lamp's behaviour under tilt: as many as are announced.
        notes: about repairs.
        edition: the first line, which tells the edition.
    """

    name: str
    called: str
    tilt: str
    values: np.ndarray
    notes: tuple[str, ...]
    edition: str

    @staticmethod
    def of(data: bytes, name: str) -> _Text:
        """The parts, with the numbers found to be a table."""
        lines = lines_of(data)
        matches = ((k, TILT.fullmatch(line)) for k, line in enumerate(lines))
        place, tilt = next(((k, match[1].upper()) for k, match in matches if match), (0, ""))
        if not tilt:
            raise PureLightError(f"{name}: not IES LM-63 text: it has no line TILT=")
        words = _keywords(lines[:place])
        values, notes = table_numbers("\n".join(lines[place + 1 :]), tilt, name)
        called = words.get("LUMINAIRE") or words.get("LUMCAT") or name
        return _Text(name, called, tilt, values, tuple(notes), lines[0])

    @property
    def kind(self) -> int:
        return int(self.values[5])

    def photometry(self) -> LampPhotometry:
        """The lamp from its numbers."""
        count, lumens, multiplier, rows, planes, _, unit, *size, ballast, extra, watts = (
            float(x) for x in self.values[:HEADER]
        )
        ends = HEADER + np.cumsum([rows, planes, rows * planes]).astype(int)
        vertical, horizontal, candela = np.split(self.values[: ends[-1]], [HEADER, *ends[:-1]])[1:]
        candela = candela.reshape(int(planes), int(rows))
        vertical, candela, repaired = rising(vertical, candela.T, "vertical", self.name)
        horizontal, candela, again = rising(horizontal, candela.T, "horizontal", self.name)
        notes = [*_tilt_notes(self.tilt), *self.notes, *repaired, *again]
        counts = extra > 0 and not UNUSED.search(self.edition)
        candela = candela * multiplier * ballast * (extra if counts else 1.0)
        if (candela < 0).any():
            notes.append("negative intensities are taken as 0")
        if unit not in (1, 2):
            notes.append(f"unit {unit:g} of lengths is unknown; they are taken as metres")
        table = as_type_c(self.kind, vertical, horizontal, np.maximum(candela, 0))
        old = not NEWER.search(self.edition)
        opening = Opening.of_ies(size, FEET if unit == 1 else METRES, old=old)
        bare = count * lumens if lumens > 0 else None
        return LampPhotometry(
            self.called, table, opening, bare, max(watts, 0.0), tuple(notes), lengthwise=0.0
        )  # fmt: skip


def _keywords(lines: list[str]) -> dict[str, str]:
    """The first text of each keyword."""
    found: dict[str, str] = {}
    for line in lines:
        if match := KEYWORD.fullmatch(line):
            found.setdefault(match[1].upper(), match[2].strip())
    return found


def _tilt_notes(tilt: str) -> list[str]:
    if tilt == "NONE":
        return []
    return [f"TILT={tilt[:60]} is not applied: the luminaire hangs as it was measured"]
