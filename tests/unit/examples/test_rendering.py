"""Timed renderings: their halves tell the noise, and blocks keep the bias."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from purelight_examples import rendering
from purelight_examples.scenes import room
from purelight_examples.scenes.lamp_choice import SphereLamp
from purelight_mitsuba import platform


def test_noise_is_judged_from_the_halves() -> None:
    rng = np.random.default_rng(0)
    exact = np.ones((64, 64, 3))
    halves = [exact + 0.1 * rng.normal(size=exact.shape) for _ in range(2)]
    image = (halves[0] + halves[1]) / 2
    judged = rendering.Rendering(image, 2, 1.0, (halves[0], halves[1])).noise()
    true = rendering.errors(image, exact)
    for name, error in judged.items():
        assert error == pytest.approx(true[name], rel=0.1), name


def test_blocks_keep_bias_and_lose_noise() -> None:
    rng = np.random.default_rng(1)
    exact = np.ones((63, 66, 3))
    found = rendering.errors(exact * 1.05 + 0.2 * rng.normal(size=exact.shape), exact)
    assert found["mape"] > 0.15
    assert found["mape_blocks"] == pytest.approx(0.05, abs=0.02)
    assert rendering.blocks(exact).shape == (15, 16, 3)


def test_renders_passes_until_the_time_is_used(tmp_path: Path) -> None:
    platform.use()
    scene = room.write(tmp_path, SphereLamp((1.0, 1.0, 1.0)), room.Picture(16, 12))
    short = rendering.render_for(scene, 1e-9)
    assert short.spp == 8
    np.testing.assert_allclose(short.image, (short.halves[0] + short.halves[1]) / 2)
    assert short.image.shape == (12, 16, 3)


@pytest.mark.parametrize(("spp", "made", "first_half"), [(1, 2, 1 / 2), (20, 21, 2 / 3)])
def test_renders_at_least_the_paths_asked_for(
    spp: int, made: int, first_half: float, tmp_path: Path
) -> None:
    platform.use()
    scene = room.write(tmp_path, SphereLamp((1.0, 1.0, 1.0)), room.Picture(16, 12))
    found = rendering.render(scene, spp)
    assert found.spp == made
    a, b = found.halves
    np.testing.assert_allclose(found.image, first_half * a + (1 - first_half) * b)
