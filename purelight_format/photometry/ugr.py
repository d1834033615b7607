r"""The table of unified glare ratings of a luminaire: CIE 117:1995 by the rooms of CIE 190:2010.

.. math:: UGR = 8 \log_{10}\left(\frac{0.25}{L_b} \sum_i \frac{L_i^2 \omega_i}{p_i^2}\right)

over the luminaires of a regular array with spacing 0.25 H all over a room, H above the eyes of an
observer at the middle of a wall who looks along Y. L_i^2 omega_i = I_i^2 / (A_i r_i^2), with the
intensity I towards the eye, the luminous area A that is seen from there, and the distance r. The
background luminance L_b is the indirect illuminance of the walls over pi. Transfer of light between
floor, walls and ceiling is solved (`room`), which gives the factors tabulated in CIE 190; direct
light is summed over directions instead of CIE 190's zones.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.room import direct_shares, received

# Across and along the line of sight, in H
ROOMS = (
    *((2, y) for y in (2, 3, 4, 6, 8, 12)), *((4, y) for y in (2, 3, 4, 6, 8, 12)),
    *((8, y) for y in (4, 6, 8, 12)), *((12, y) for y in (4, 6, 8)),
)  # fmt: skip
REFLECTANCES = ((0.7, 0.5, 0.2), (0.7, 0.3, 0.2), (0.5, 0.5, 0.2), (0.5, 0.3, 0.2),
                (0.3, 0.3, 0.2))  # Of ceiling, walls and floor.  # fmt: skip
SPACING = 0.25  # In H.
STEEPEST, WIDEST, FLATTEST = 1.9, 3.0, 85.0  # H/R and T/R in view, and degrees from nadir.
HEIGHT = 2.0  # Metres; it cancels out.
LEAST = 10  # Below it, tables give no rating.


@dataclass(frozen=True)
class UgrTable:
    """Ratings of all rooms and reflectances.

    Arguments:
        values: [19, 10], five reflectances seen crosswise (at right angles to the luminaire's
            length), then endwise; -inf where no luminaire sends light to the eye.
    """

    values: np.ndarray

    @staticmethod
    def of(lamp: LampPhotometry, spacing: float = SPACING) -> UgrTable:
        """The table of a lamp.

        Arguments:
            spacing: of the luminaires, in H.

        Raises:
            PureLightError: The lamp has no luminous area, or no light.
        """
        if lamp.opening.is_point:
            raise PureLightError(f"{lamp.name}: without a luminous area it has no glare rating")
        if not lamp.table.flux > 0:
            raise PureLightError(f"{lamp.name}: without light it has no glare rating")
        rows = []
        for x, y in ROOMS:
            background = _background(lamp, x, y, spacing)
            turns = (90.0 - lamp.lengthwise, lamp.lengthwise)  # Of 0 and 90 degrees
            glare = [_glare(lamp, x, y, spacing, turn) for turn in turns]
            with np.errstate(divide="ignore"):
                rows.append(8 * np.log10(0.25 * np.divide.outer(glare, background)).ravel())
        return UgrTable(np.array(rows))

    def to_json(self) -> dict[str, Any]:
        """For programs: ratings by room, crosswise and endwise."""
        return {
            "reflectances": [list(of) for of in REFLECTANCES],
            "spacing": SPACING,
            "rooms": [list(room) for room in ROOMS],
            "crosswise": self._rounded(slice(0, 5)),
            "endwise": self._rounded(slice(5, 10)),
        }

    def _rounded(self, columns: slice) -> list[list[float | None]]:
        part = self.values[:, columns]
        return [[round(float(x), 2) if np.isfinite(x) else None for x in row] for row in part]

    def to_text(self) -> str:
        """For people: a line for each room; below 10 there is no rating."""
        parts = [
            [f"{round(100 * row[k])}" for row in REFLECTANCES * 2] for k in range(3)
        ]  # Of ceiling, walls and floor
        heads = [
            f"{name:<9}" + "".join(f"{x:>6}" for x in part[:5]) + "  " + "".join(
                f"{x:>6}" for x in part[5:]) for name, part in zip(
                ("ceiling", "walls", "floor"), parts, strict=True)
        ]  # fmt: skip
        title = f"{'UGR':<9}{'crosswise':>30}  {'endwise':>30}"
        rows = [
            f"{f'{x}H':>3} {f'{y}H':<5}" + _cells(row[:5]) + "  " + _cells(row[5:])
            for (x, y), row in zip(ROOMS, self.values, strict=True)
        ]
        return "\n".join([title, *heads, *rows])


def _background(lamp: LampPhotometry, x: float, y: float, spacing: float) -> np.ndarray:
    """Background luminance in cd/m² under each of the reflectances: [5]."""
    flux = lamp.table.flux * round(x / spacing) * round(y / spacing)
    walls = 2 * HEIGHT**2 * (x + y)
    direct = direct_shares(lamp.table, x, y)
    indirect = [
        received(direct, (floor, wall, ceiling), x, y)[1] - direct[1]
        for ceiling, wall, floor in REFLECTANCES
    ]
    return flux * np.array(indirect) / walls / np.pi


def _glare(lamp: LampPhotometry, x: float, y: float, spacing: float, turn: float) -> float:
    """Sum of L² omega / p² over the luminaires in view.

    Arguments:
        turn: plane C of the luminaires that faces the observer, in degrees.
    """
    across = (np.arange(round(x / spacing)) + 0.5) * spacing - x / 2
    ahead = (np.arange(round(y / spacing)) + 0.5) * spacing
    aside, depth = (grid.ravel() for grid in np.meshgrid(across, ahead))
    level = np.hypot(aside, depth)
    gamma = np.degrees(np.arctan(level))
    seen = (1 / depth <= STEEPEST) & (np.abs(aside) / depth <= WIDEST) & (gamma <= FLATTEST)
    aside, depth, gamma = aside[seen], depth[seen], gamma[seen]
    plane = (turn + np.degrees(np.arctan2(aside, depth))) % 360
    intensity = lamp.table.at(gamma, plane)
    area = lamp.opening.projected_area(gamma, plane)
    square = (1 + aside**2 + depth**2) * HEIGHT**2
    lit = (intensity > 0) & (area > 0)
    index = position_index(1 / depth[lit], aside[lit] / depth[lit])
    return float((intensity[lit] ** 2 / (area[lit] * square[lit] * index**2)).sum())


def position_index(up: np.ndarray, aside: np.ndarray) -> np.ndarray:
    """Guth's position index of places in the field of view: [N].

    The closed form of Levin (1975) that the IES Lighting Handbook gives, within a few percent of
    table 4.1 of CIE 117.

    Arguments:
        up, aside: [N] height and distance aside over the distance ahead.
    """
    tau = np.degrees(np.arctan2(np.abs(aside), up))  # From the vertical plane.
    sigma = np.degrees(np.arctan(np.hypot(up, aside)))  # From the line of sight.
    linear = 35.2 - 0.31889 * tau - 1.22 * np.exp(-2 * tau / 9)
    square = 21 + 0.26667 * tau - 0.002963 * tau**2
    return np.exp(linear * 1e-3 * sigma + square * 1e-5 * sigma**2)


def _cells(row: np.ndarray) -> str:
    return "".join(f"{f'{x:.1f}' if x >= LEAST else f'<{LEAST}':>6}" for x in row)
