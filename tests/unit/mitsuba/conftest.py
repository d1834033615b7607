"""Mitsuba's variant, for every test of the runtime."""

from __future__ import annotations

from purelight_mitsuba import use

use()
