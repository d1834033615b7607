"""The reference of the benchmark of a measured LED: a lens of a plane and a sphere."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import measured_led as led
from purelight_format.ray_file.rays import Rays


def beam(place: list[float], toward: list[float], count: int = 1000) -> Rays:
    """Equal rays."""
    direction = np.array(toward) / np.linalg.norm(toward)
    return Rays(
        np.tile(place, (count, 1)).astype(np.float32),
        np.tile(direction, (count, 1)).astype(np.float32),
        np.full((count, 3), 1e-3, np.float32),
    )


def test_along_the_axis_the_lens_lets_through_what_fresnel_says() -> None:
    """Two surfaces of reflectance R pass (1 - R) / (1 + R) of the light, in the end."""
    left = led.through_lens(beam([0, 0, 0], [0, 0, 1], 200_000), np.random.default_rng(0))
    reflected = ((led.IOR - 1) / (led.IOR + 1)) ** 2
    ahead = float((left.direction[:, 2] > 0).mean())
    expected = (1 - reflected) / (1 + reflected)
    assert ahead == pytest.approx(expected, abs=5 * np.sqrt(expected * (1 - expected) / 200_000))


def test_a_ray_is_bent_by_snell_at_both_surfaces() -> None:
    """Straight through the plane, then by asin(n sin a) - a towards the axis."""
    height = 6e-3
    left = led.through_lens(beam([height, 0, 0], [0, 0, 1]), np.random.default_rng(0))
    passed = np.median(left.direction, 0)  # Few are reflected first.
    angle = np.arcsin(height / led.RADIUS)
    bend = np.arcsin(led.IOR * np.sin(angle)) - angle
    np.testing.assert_allclose(passed, [-np.sin(bend), 0, np.cos(bend)], atol=1e-6)


def test_no_light_is_lost_and_none_stays() -> None:
    rng = np.random.default_rng(3)
    toward = rng.normal(size=(10_000, 3))
    rays = Rays(
        np.zeros((10_000, 3), np.float32),
        (toward / np.linalg.norm(toward, axis=1, keepdims=True)).astype(np.float32),
        np.ones((10_000, 3), np.float32),
    )
    left = led.through_lens(rays, rng)
    assert len(left) == len(rays)
    np.testing.assert_allclose(np.linalg.norm(left.direction, axis=1), 1, atol=1e-6)


def test_rays_past_the_lens_are_left_alone() -> None:
    rays = beam([0, 0, 0], [1, 0, 0.01])
    left = led.through_lens(rays, np.random.default_rng(0))
    np.testing.assert_array_equal(left.direction, rays.direction)


def test_the_mesh_is_the_same_lens() -> None:
    mesh = led.lens()
    mesh.merge_vertices(merge_norm=True)
    deep = led.RADIUS - (led.PLANE - led.CENTRE)  # Of the cap of a ball.
    volume = np.pi * deep**2 * (3 * led.RADIUS - deep) / 3
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(volume, rel=1e-3)
