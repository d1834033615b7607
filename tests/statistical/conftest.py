"""Mitsuba's variant, for every rendering."""

from __future__ import annotations

from purelight_mitsuba import use

use()
