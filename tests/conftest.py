"""Chooses Dr.Jit's LLVM before any test imports Mitsuba."""

from __future__ import annotations

from purelight_mitsuba import platform

platform.prepare()
