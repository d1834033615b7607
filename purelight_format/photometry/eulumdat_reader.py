"""EULUMDAT (.ldt) text.

Layout after A. W. Stockmar, "EULUMDAT file format specification": one item a line, 26 of the
luminaire, six of each set of lamps, ten direct ratios, then angles C, angles G, and intensities in
cd per 1000 lm of the lamps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.nodes import rising
from purelight_format.photometry.opening import BOX, DRUM, Opening
from purelight_format.photometry.table import IntensityTable
from purelight_format.photometry.text import lines_of, number, numbers

HEADER, SET, RATIOS = 26, 6, 10  # Lines before the lamps, lines of a set, direct ratios.
SHORT_SET = 3
MOST_SETS = 20
NODES = 1 << 20
MILLIMETRE = 1e-3
# By symmetry: where in the circle the stored planes begin, and what part of it they cover
STORED = {0: (0.0, 1.0), 1: (0.0, 0.0), 2: (0.0, 0.5), 3: (0.75, 0.5), 4: (0.0, 0.25)}
LORL_SLACK = 0.05


def eulumdat_photometry(data: bytes, name: str) -> LampPhotometry:
    """Reads EULUMDAT text.

    Of several sets of lamps, which are alternatives, the first one counts. Intensities are those of
    the luminaire with its lamps: the file's values times its conversion factor and the lamps' flux.

    Arguments:
        name: What to call the lamp in errors, and where the file does not name it.

    Raises:
        PureLightError: If it is not EULUMDAT text, or not what it says.
    """
    header = Header(lines_of(data), name)
    stored = _table(header)
    vertical, rows, repaired = rising(stored.angles, stored.values.T, "vertical", name)
    horizontal, rows, again = rising(stored.planes, rows.T, "horizontal", name)
    notes = [*header.notes(), *stored.notes, *repaired, *again]
    if (rows < 0).any():
        notes.append("negative intensities are taken as 0")
    table = IntensityTable(vertical, horizontal, np.maximum(rows, 0) * header.candela)
    notes += _output_note(header, table.flux)
    lumens = None if header.absolute else header.lumens
    watts = max(header.item(32), 0.0) if header.sets and stored.layout.set == SET else 0.0
    return LampPhotometry(header.called, table, header.opening, lumens, watts, tuple(notes))


@dataclass(frozen=True)
class Header:
    """The items before the table, by their numbers in the specification."""

    lines: list[str]
    name: str

    def item(self, place: int) -> float:
        """The number of item `place`, from 1; 0 where there is none."""
        if place > len(self.lines):
            return 0.0
        return _first_number(self.lines[place - 1])

    def count(self, place: int, what: str, most: int) -> int:
        """A count that has to be there."""
        value = self.item(place)
        if not (value.is_integer() and 0 <= value <= most):
            found = f"{value:g} {what} in line {place}"
            raise PureLightError(f"{self.name}: not EULUMDAT text: {found}")
        return int(value)

    @property
    def symmetry(self) -> int:
        return self.count(3, "as symmetry", max(STORED))

    @property
    def sets(self) -> int:
        return self.count(26, "sets of lamps", MOST_SETS)

    def tail(self, set_lines: int) -> str:
        """What follows the lamps, each set of so many lines."""
        return "\n".join(self.lines[HEADER + set_lines * self.sets :])

    @property
    def called(self) -> str:
        return self.lines[8] or self.lines[9] or self.name

    @property
    def absolute(self) -> bool:
        """Whether the flux is that of the luminaire: a negative number of lamps says so."""
        return self.sets == 0 or self.item(27) < 0

    @property
    def lumens(self) -> float:
        return self.item(29) if self.sets else 1000.0

    @property
    def candela(self) -> float:
        """What a value of the table is, in candela."""
        return max(self.lumens, 0.0) / 1000 * (self.item(24) if self.item(24) > 0 else 1.0)

    @property
    def opening(self) -> Opening:
        length, width, *heights = (abs(self.item(k)) * MILLIMETRE for k in range(16, 22))
        shape = DRUM if width == 0 else BOX
        c0, c90, c180, c270 = heights
        return Opening(width or length, length, (c0, c90, c180, c270), shape)

    def notes(self) -> list[str]:
        found = []
        if self.sets > 1:
            found.append(f"{self.sets} sets of lamps; the first one counts")
        if self.sets == 0:
            found.append("no lamps, so that 1000 lm are assumed")
        if self.item(25):
            found.append(f"measured at a tilt of {self.item(25):g} degrees, which is not applied")
        return found


class Layout(NamedTuple):
    """How many lines a set of lamps has, ratios there are, planes are listed, and are stored."""

    set: int
    ratios: int
    listed: int
    stored: int


class _Stored(NamedTuple):
    """Planes [P], angles [G] and values [P, G] as they are stored in a layout."""

    layout: Layout
    planes: np.ndarray
    angles: np.ndarray
    values: np.ndarray
    notes: list[str]


def _table(header: Header) -> _Stored:
    """The table that a file holds.

    Some programs leave out the ratios or half of the lamps' lines, list the stored planes alone, or
    store all planes whatever the symmetry. That layout counts whose numbers come out even, or
    else the first one that has enough of them.
    """
    circle = header.count(4, "C planes", NODES) or 1
    rows = header.count(6, "angles G", NODES)
    begin, part = STORED[header.symmetry]
    first, stored = round(begin * circle), round(part * circle) + (header.symmetry > 0)
    if rows < 2 or circle * rows > NODES:
        raise PureLightError(f"{header.name}: not EULUMDAT text: {circle} planes of {rows} angles")
    layouts = [
        Layout(SET, RATIOS, circle, stored), Layout(SET, RATIOS, circle, circle),
        Layout(SET, RATIOS, stored, stored), Layout(SET, 0, circle, stored),
        Layout(SHORT_SET, 0, circle, circle),
    ]  # fmt: skip
    fits = [found for layout in layouts if (found := _of_layout(header, layout, rows))]
    if not fits:
        raise PureLightError(
            f"{header.name}: not EULUMDAT text: after the lamps there are no {stored} planes of "
            f"{rows} intensities under angles that rise"
        )
    even, layout, planes, angles, values = next((found for found in fits if found[0]), fits[0])
    notes = [] if even else ["more numbers than its header announces; the rest is left out"]
    return _Stored(layout, _stored_planes(planes, first, len(values)), angles, values, notes)


def _of_layout(
    header: Header, layout: Layout, rows: int
) -> tuple[bool, Layout, np.ndarray, np.ndarray, np.ndarray] | None:
    """Whether a layout uses all numbers, and what it finds; None if it cannot be."""
    start = layout.ratios + layout.listed
    needed = start + rows + layout.stored * rows
    tail = numbers(header.tail(layout.set).replace(",", "."), needed + 1)
    if len(tail) < needed:
        return None
    planes, angles = tail[layout.ratios : start], tail[start : start + rows]
    falls = int((np.diff(planes) <= 0).sum())
    if (np.diff(angles) <= 0).any() or falls > 1:
        return None
    values = tail[start + rows : needed].reshape(layout.stored, rows)
    return len(tail) == needed, layout, planes, angles, values


def _stored_planes(listed: np.ndarray, first: int, kept: int) -> np.ndarray:
    """Angles of the planes whose values are stored: [kept], rising beyond 360 if need be."""
    if kept == 1:
        return np.zeros(1)
    planes = listed if len(listed) == kept else listed[(first + np.arange(kept)) % len(listed)]
    turns = np.concatenate([[0], np.cumsum(np.diff(planes) < 0)])
    return planes + 360.0 * turns


def _output_note(header: Header, flux: float) -> list[str]:
    """A word about a table that is not as bright as its header says."""
    stated = header.item(23) / 100 * header.lumens
    if stated > 0 and abs(flux / stated - 1) > LORL_SLACK:
        return [f"the table gives {flux:.4g} lm, its header says {stated:.4g} lm; the table counts"]
    return []


def _first_number(text: str) -> float:
    """The number that a line begins with, with a decimal point or comma; 0 without one."""
    words = text.split()
    value = number(words[0].replace(",", ".")) if words else None
    return 0.0 if value is None else value
