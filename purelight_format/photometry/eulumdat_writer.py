"""A lamp as EULUMDAT (.ldt) text; see `eulumdat_reader` for its layout."""

from __future__ import annotations

import numpy as np

from purelight_format.photometry.eulumdat_reader import MILLIMETRE, STORED
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.room import direct_shares
from purelight_format.photometry.symmetry import symmetry
from purelight_format.photometry.table import IntensityTable

LONGEST = 78  # Characters of a line of text.
ROOM_INDICES = (0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
ROUND, OTHER = 1, 3  # Types: a point source that is symmetric about its axis, or that is not.


def eulumdat_text(
    lamp: LampPhotometry, *, maker: str, issued: str, size: tuple[float, float, float]
) -> bytes:
    """EULUMDAT text in absolute photometry: minus one lamp that has the luminaire's flux.

    Arguments:
        maker: Who made the data.
        issued: Date, YYYY-MM-DD.
        size: Of the luminaire along X, Y and Z, in metres.
    """
    kind, planes, rows = _planes(lamp.table)
    flux = lamp.table.flux
    scale = 1000 / flux if flux > 0 else 0.0
    floor, walls, _ = direct_shares(lamp.table, 1.0, 1.0)
    x, y, z = size
    lines = [
        _line(maker), str(ROUND if kind == 1 else OTHER), str(kind),
        str(len(planes)), _number(_step(planes)), str(len(lamp.table.vertical)),
        _number(_step(lamp.table.vertical)), "Light-traced simulation", _line(lamp.name), "",
        "", _line(f"{issued} {maker}"), *map(_millimetres, (y, x, z)), *_opening_lines(lamp),
        _number(100 * (floor + walls)), "100", "1", "0",
        "1", "-1", "Light-traced simulation", _number(flux), "-", "-", _number(lamp.watts),
        *(_number(_direct_ratio(lamp.table, k)) for k in ROOM_INDICES),
        *map(_number, planes), *map(_number, lamp.table.vertical),
    ]  # fmt: skip
    first, stored = _stored(kind, len(planes))
    for k in range(stored):
        lines += map(_number, rows[(first + k) % len(planes)] * scale)
    return ("\r\n".join(lines) + "\r\n").encode("cp1252", "replace")


def _planes(table: IntensityTable) -> tuple[int, np.ndarray, np.ndarray]:
    """Symmetry, the planes of the whole circle without 360, and their candela."""
    angles, rows = table.whole
    kind = symmetry(table.horizontal, table.candela)
    if kind == 1:
        return kind, np.zeros(1), rows[:1]
    planes = angles[:-1]
    first, stored = _stored(kind, len(planes))
    begin, part = STORED[kind]
    ends = planes[[first % len(planes), (first + stored - 1) % len(planes)]]
    if len(planes) % 4 or not np.allclose(ends, [360 * begin % 360, 360 * (begin + part) % 360]):
        kind = 0
    return kind, planes, rows[:-1]


def _stored(kind: int, circle: int) -> tuple[int, int]:
    """The first plane that is stored, and how many are."""
    begin, part = STORED[kind]
    return round(begin * circle), round(part * circle) + (kind > 0)


def _direct_ratio(table: IntensityTable, index: float) -> float:
    """Part of the downward flux that reaches the floor directly, in a square room of an index."""
    floor, walls, _ = direct_shares(table, 2 * index, 2 * index)
    return floor / (floor + walls) if floor + walls > 0 else 0.0


def _opening_lines(lamp: LampPhotometry) -> list[str]:
    length, width, heights = lamp.opening.to_eulumdat()
    return [_millimetres(value) for value in (length, width, *heights)]


def _step(angles: np.ndarray) -> float:
    """The step between angles, 0 where it varies."""
    steps = np.diff(angles)
    return float(steps[0]) if len(steps) and np.allclose(steps, steps[0]) else 0.0


def _millimetres(metres: float) -> str:
    return _number(round(metres / MILLIMETRE, 1))


def _number(value: float) -> str:
    return np.format_float_positional(value, precision=6, fractional=False, trim="-")


def _line(text: str) -> str:
    return " ".join(text.split())[:LONGEST]
