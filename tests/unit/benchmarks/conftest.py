"""Mitsuba's variant, for every test of what is measured in Mitsuba."""

from __future__ import annotations

from purelight_mitsuba import use

use()
