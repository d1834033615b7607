"""Rays against the exit surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh


def test_rays_that_are_blocked_are_those_that_hit(
    mitsuba: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In batches too, and of no rays at all."""
    from purelight_train.light import exit_surface
    from purelight_train.light.exit_surface import ExitSurface, inward_rays

    monkeypatch.setattr(exit_surface, "RAY_BATCH", 1000)
    ring = trimesh.creation.torus(1, 0.3)
    corners, faces = np.float32(ring.vertices), np.uint32(ring.faces)
    surface = ExitSurface(corners, faces, np.zeros(len(faces), bool))
    rays = inward_rays(surface.sphere, 2500, np.random.default_rng(0), cosine=True)
    blocked = surface.blocked(*rays)
    assert 0.3 < blocked.mean() < 0.9
    np.testing.assert_array_equal(np.flatnonzero(blocked), surface.intersect(*rays).index)
    away = surface.blocked(rays[0], -rays[1])
    assert not away.any()
    assert surface.concave
    assert len(surface.blocked(*(column[:0] for column in rays))) == 0
