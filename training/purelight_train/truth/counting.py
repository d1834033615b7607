"""How well a finite number of rays knows a lamp: standard errors of a count (Poisson).

Every ray is one event of its power; a sum over some of them is known up to the root of the sum of
the squares of their powers. What all rays sum up to may be known better, if it was measured as a
whole: these errors are those of its parts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.color import LUMINANCE
from purelight_format.measures import BoundingSphere
from purelight_train.light.exit_records import ExitRecords
from purelight_train.truth.far_field import IntensityZones
from purelight_train.truth.plane import Plane, plane_irradiance

LIT = 0.05  # Of the largest: zones and cells below it are not told.
DISTANCE = 5.0  # Radii from the lamp's centre to a plane.


def counting_errors(records: ExitRecords, sphere: BoundingSphere) -> dict[str, Any]:
    """Relative standard errors of luminous quantities, as far as rays are counted.

    Returns:
        of the flux; of the intensity in 192 zones of equal solid angle; and of the illuminance on
        16 x 16 cells of planes below and above, `DISTANCE` away and twice as wide: where they are
        largest, and the median over those with at least `LIT` of that.
    """
    luminous = np.repeat((records.weight @ LUMINANCE)[:, None], 3, 1).astype(np.float32)
    grey = replace(records, weight=luminous, counted=True)
    zones = IntensityZones.of(grey)
    flux, error = grey.flux[0], grey.flux_error[0]
    found = {
        "flux": _rounded(error / flux) if flux > 0 else None,
        "intensity": _summary(zones.intensity[..., 0], zones.error[..., 0]),
    }
    away = DISTANCE * sphere.radius
    for name, distance in (("irradiance_below", away), ("irradiance_above", -away)):
        plane = Plane.below(sphere, distance, 2 * away)
        found[name] = _summary(*(image[..., 0] for image in plane_irradiance(grey, plane)))
    return {"relative_error": found}


def _summary(value: NDArray[np.float64], error: NDArray[np.float64]) -> dict[str, float] | None:
    """Relative errors at the largest value and in the median; None without any light."""
    if not value.max() > 0:
        return None
    lit = value >= LIT * value.max()
    relative = error[lit] / value[lit]
    return {
        "at_peak": _rounded(relative[value[lit].argmax()]), "median": _rounded(np.median(relative))
    }  # fmt: skip


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")
