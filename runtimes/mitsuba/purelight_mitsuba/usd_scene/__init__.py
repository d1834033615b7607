"""Scenes of OpenUSD, read into Mitsuba."""

from __future__ import annotations

from purelight_mitsuba.usd_scene.stage import UsdScene, load_usd

__all__ = ["UsdScene", "load_usd"]
