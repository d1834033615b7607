"""Multiple importance sampling: what a technique counts that finds what another could have found.

Veach's heuristics (1997, Sec. 9.2) of two densities in the same measure.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

CUT = 0.1


def power(a: mi.Float, b: mi.Float) -> mi.Float:
    """The power heuristic, free of overflow; zero where a is."""
    ratio = dr.select(a > 0, b / a, dr.inf)
    return 1 / (1 + dr.square(ratio))


def cutoff(a: mi.Float, b: mi.Float) -> mi.Float:
    """The cutoff heuristic: as `power`, but a tenth of the other density is worth nothing."""
    return dr.select(a < CUT * b, 0, dr.select(b < CUT * a, 1, power(a, b)))
