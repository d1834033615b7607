"""IES LM-63 text of any edition, 1986 to 2019."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.goniometer import TYPE_A, TYPE_C, as_type_c
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.nodes import rising
from purelight_format.photometry.opening import Opening
from purelight_format.photometry.table import IntensityTable
from purelight_format.photometry.text import lines_of, numbers

HEADER = 13  # Numbers before the angles.
TILT = re.compile(r"\s*TILT\s*=\s*(.*?)\s*", re.IGNORECASE)
KEYWORD = re.compile(r"\s*\[(\w+)\]\s*(.*)")
NEWER = re.compile(r"LM-63-(20\d\d)")  # Their 12th number is no factor any more.
FEET, METRES = 0.3048, 1.0
NODES = 1 << 20  # Of a table; whole degrees all around are 65,000.


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
    its ballast factor, and before 2002 times its ballast-lamp factor. How a lamp behaves when it is
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
        old: whether the edition is one in which the 12th number is the ballast-lamp factor.
    """

    name: str
    called: str
    tilt: str
    values: np.ndarray
    notes: tuple[str, ...]
    old: bool

    @staticmethod
    def of(data: bytes, name: str) -> _Text:
        """The parts, with the numbers found to be a table."""
        lines = lines_of(data)
        matches = ((k, TILT.fullmatch(line)) for k, line in enumerate(lines))
        place, tilt = next(((k, match[1].upper()) for k, match in matches if match), (0, ""))
        if not tilt:
            raise PureLightError(f"{name}: not IES LM-63 text: it has no line TILT=")
        words = _keywords(lines[:place])
        values, notes = _values("\n".join(lines[place + 1 :]), tilt, name)
        called = words.get("LUMINAIRE") or words.get("LUMCAT") or name
        old = not NEWER.search(lines[0])
        return _Text(name, called, tilt, values, tuple(notes), old)

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
        candela = candela * multiplier * ballast * (extra if self.old and extra > 0 else 1.0)
        if (candela < 0).any():
            notes.append("negative intensities are taken as 0")
        if unit not in (1, 2):
            notes.append(f"unit {unit:g} of lengths is unknown; they are taken as metres")
        table = as_type_c(self.kind, vertical, horizontal, np.maximum(candela, 0))
        opening = Opening.of_ies(size, FEET if unit == 1 else METRES, old=self.old)
        bare = count * lumens if lumens > 0 else None
        return LampPhotometry(
            self.called, table, opening, bare, max(watts, 0.0), tuple(notes)
        )  # fmt: skip


def _values(text: str, tilt: str, name: str) -> tuple[np.ndarray, list[str]]:
    """The numbers after TILT: as many as the file says that there are."""
    problem = ""
    for candidate in (text, text.replace(",", ".")):  # Commas separate, or are decimal points.
        values = numbers(candidate, HEADER + 4 * NODES)
        if tilt == "INCLUDE":
            values = _behind_tilt(values, name)
        problem = _problem(values)
        if not problem:
            decimal = candidate is not text and candidate != text
            return values, ["commas are taken as decimal points"] if decimal else []
    raise PureLightError(f"{name}: not IES LM-63 text: {problem}")


def _behind_tilt(values: np.ndarray, name: str) -> np.ndarray:
    """What follows the lamp's geometry, and the count of its angles, angles and factors."""
    count = values[1] if len(values) > 1 else -1.0
    if not (count.is_integer() and 0 <= count < len(values)):
        raise PureLightError(f"{name}: not IES LM-63 text: no angles follow TILT=INCLUDE")
    return values[2 + 2 * int(count) :]


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
    wanted = HEADER + rows + planes + rows * planes
    if len(values) < wanted:
        return f"{len(values)} numbers, where its header announces {wanted:g}"
    return ""


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
