"""Two light distributions beside each other."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from purelight_format.photometry.figures import PLANES, Figures
from purelight_format.photometry.lamp_photometry import LampPhotometry
from purelight_format.photometry.table import node_solid_angle

VERTICAL, HORIZONTAL = np.linspace(0, 180, 181), np.arange(0, 360, 2.5)
BETTER = 0.5  # Of the difference, from which on a turned lamp is worth a word.


@dataclass(frozen=True)
class Comparison:
    """A lamp against a reference."""

    lamp: LampPhotometry
    reference: LampPhotometry

    @cached_property
    def figures(self) -> tuple[Figures, Figures]:
        """Of the lamp, and of the reference."""
        return Figures.of(self.lamp.table), Figures.of(self.reference.table)

    def rms(self, *, turned: float = 0.0, same_flux: bool = False) -> float:
        """Root of the mean square difference over all directions, relative to the reference's.

        Arguments:
            turned: degrees by which the lamp is turned about the vertical axis.
            same_flux: whether it is given the reference's flux before.
        """
        mine = self.lamp.table.resampled(VERTICAL, (HORIZONTAL - turned) % 360)
        theirs = self.reference.table.resampled(VERTICAL, HORIZONTAL)
        ours, wanted = (one.flux for one in self.figures)
        if same_flux and ours > 0:
            mine = mine * (wanted / ours)
        weight = node_solid_angle(VERTICAL)
        squares = [float((value**2 @ weight).mean()) for value in (mine - theirs, theirs)]
        return float(np.sqrt(squares[0] / squares[1])) if squares[1] > 0 else float("nan")

    @cached_property
    def better_turned(self) -> float:
        """Quarter turns, in degrees, that halve the difference; 0 if none does."""
        straight = self.rms(same_flux=True)
        turns = {turn: self.rms(turned=turn, same_flux=True) for turn in (90.0, 180.0, 270.0)}
        best = min(turns, key=lambda turn: turns[turn])
        return best if turns[best] < BETTER * straight else 0.0

    def to_json(self) -> dict[str, Any]:
        """For programs; angles in degrees."""
        lamp, reference = self.figures
        return {
            "lamp": asdict(lamp),
            "reference": asdict(reference) | {"notes": list(self.reference.notes)},
            "rms": _finite(self.rms()),
            "rms_of_shape": _finite(self.rms(same_flux=True)),
            "better_turned": self.better_turned,
        }

    def to_text(self) -> str:
        """For people."""
        lamp, reference = self.figures
        rows = [("", "lamp", "reference", "difference")]
        rows.append(_row("flux", lamp.flux, reference.flux, "lm"))
        rows.append(_row("peak", lamp.peak, reference.peak, "cd"))
        rows.append(("  towards", _direction(lamp), _direction(reference), ""))
        for name, _ in PLANES:
            rows.append(_angles(f"beam {name}", lamp.beam[name], reference.beam[name]))
        for name, _ in PLANES:
            rows.append(_angles(f"field {name}", lamp.field[name], reference.field[name]))
        down, theirs = (round(100 * one.downward, 1) for one in (lamp, reference))
        rows.append(("downwards", f"{down} %", f"{theirs} %", f"{down - theirs:+.1f}"))
        lines = [f"{a:<16}{b:>16}{c:>16}{d:>14}".rstrip() for a, b, c, d in rows]
        return "\n".join([*lines, *self._words()])

    def _words(self) -> list[str]:
        found = [
            f"RMS difference {100 * self.rms():.2f} % of the reference's intensity, "
            f"{100 * self.rms(same_flux=True):.2f} % at equal flux"
        ]
        if self.better_turned:
            turned = 100 * self.rms(turned=self.better_turned, same_flux=True)
            found.append(f"turned by {self.better_turned:g} degrees it would be {turned:.2f} %: "
                         "the files may mean another direction by C0")  # fmt: skip
        return [*found, *(f"reference: {note}" for note in self.reference.notes)]


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _row(name: str, mine: float, theirs: float, unit: str) -> tuple[str, str, str, str]:
    more = f"{100 * (mine / theirs - 1):+.2f} %" if theirs > 0 else ""
    return name, f"{mine:.5g} {unit}", f"{theirs:.5g} {unit}", more


def _angles(name: str, mine: float, theirs: float) -> tuple[str, str, str, str]:
    return name, f"{mine:.1f} deg", f"{theirs:.1f} deg", f"{mine - theirs:+.1f}"


def _direction(figures: Figures) -> str:
    gamma, plane = figures.toward
    return f"{gamma:g} deg, C{plane:g}"
