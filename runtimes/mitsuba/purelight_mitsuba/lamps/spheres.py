"""Bounding spheres of the lamps of a scene."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from purelight_mitsuba.lamps.emitter import BundleEmitter


def spheres(emitters: Sequence[BundleEmitter]) -> tuple[np.ndarray, np.ndarray]:
    """Centres in the world [L, 3] and radii [L]."""
    own = [emitter.sphere() for emitter in emitters]
    return np.array([s.center for s in own]), np.array([s.radius for s in own])


def meeting(centres: np.ndarray, radii: np.ndarray, grown: float) -> np.ndarray:
    """Which spheres meet another, if all are so many times as large: [L]."""
    meets = np.zeros(len(radii), bool)
    for lamp, (centre, radius) in enumerate(zip(centres, radii, strict=True)):
        near = np.linalg.norm(centres - centre, axis=1) <= grown * (radii + radius)
        meets[lamp] = near.sum() > 1  # It meets itself
    return meets
