"""Sections of the report about measured rays: what they are worth, and the student beside them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_train.learning.flux_closure import escaping_rays
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.exit_records import ExitRecords
from purelight_train.light.radiance_field import Radiance
from purelight_train.report.page import Table

BANDS = 12  # Of equal solid angle, from nadir to zenith.
STUDENT_RAYS = 1 << 21
Column = NDArray[np.float64]


@dataclass(frozen=True)
class MeasuredLight:
    """What the report says of a lamp of measured rays.

    Arguments:
        facts: the metrics' `measured`.
        records: all rays.
        student: the learned radiance.
    """

    facts: dict[str, Any]
    records: ExitRecords
    references: ReferenceRays
    student: Radiance

    def tables(self) -> list[Table]:
        """The rays with the errors of their finite count, and intensities by bands."""
        return [self._counts(), self._bands()]

    def _counts(self) -> Table:
        facts, error = self.facts, self.facts["relative_error"]
        rows = [
            ["Rays", f"{facts['rays']:,}", f"{facts['held_out_rays']:,} of them held out"],
            ["Colours", facts["colors"], ""],
            ["Luminous flux", f"{facts['lumens']:.5g} lm", _percent(error["flux"])],
            ["Exit surface", facts["exit_surface"], "virtual" if _is_hull(facts) else "given"],
            ["Seen through the lamp", "not known", "the bundle carries no transparency"],
        ]
        for name in ("intensity", "irradiance_below", "irradiance_above"):
            if error[name]:
                rows.append([
                    name.replace("_", " ").capitalize(),
                    f"{_percent(error[name]['at_peak'])} at its peak",
                    f"{_percent(error[name]['median'])} in the median",
                ])  # fmt: skip
        rows += [["Note", note, ""] for note in facts["notes"]]
        header = ("Measured rays", "", "standard error of the count")
        return Table("What the rays are worth", header, rows)

    def _bands(self) -> Table:
        rng = np.random.default_rng(11)
        _, direction, power = escaping_rays(self.references, self.student, STUDENT_RAYS, rng)
        measured, error = _intensity(
            self.records.direction, self.records.weight / np.float32(self.records.paths)
        )
        learned, noise = _intensity(direction, power / STUDENT_RAYS)
        edge = np.degrees(np.arccos(np.linspace(1, -1, BANDS + 1)))
        rows = [
            [f"{edge[k]:.0f}° to {edge[k + 1]:.0f}°", f"{measured[k]:.4g} cd",
             _percent(error[k] / measured[k]), f"{learned[k]:.4g} cd",
             _difference(learned[k], measured[k], np.hypot(error[k], noise[k]))]
            for k in range(BANDS) if measured[k] > 0
        ]  # fmt: skip
        header = ("From nadir", "rays", "standard error", "student", "difference")
        return Table("Mean intensity around the axis", header, rows)


def _intensity(direction: NDArray[Any], power: NDArray[Any]) -> tuple[Column, Column]:
    """Mean luminous intensity in bands, and its standard error: two of [BANDS] in cd."""
    band = np.clip(((1 + direction[:, 2]) / 2 * BANDS).astype(int), 0, BANDS - 1)
    lumens = LUMENS_PER_WATT * (power.astype(np.float64) @ LUMINANCE) * BANDS / (4 * np.pi)
    first, second = (np.asarray(np.bincount(band, x, BANDS)) for x in (lumens, lumens**2))
    return first.astype(np.float64), np.sqrt(second)


def _difference(learned: float, measured: float, error: float) -> str:
    off = learned / measured - 1
    return f"{100 * off:+.1f} % ({(learned - measured) / max(error, 1e-300):+.1f} errors)"


def _is_hull(facts: dict[str, Any]) -> bool:
    return facts["exit_surface"] in ("start", "tight")


def _percent(part: float) -> str:
    return f"{100 * part:.2g} %"
