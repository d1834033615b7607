"""Subdivision surfaces as fine polygons; NumPy alone."""

from __future__ import annotations

from purelight_mitsuba.subdivision.cage import Cage
from purelight_mitsuba.subdivision.refine import Refined, refine

__all__ = ["Cage", "Refined", "refine"]
