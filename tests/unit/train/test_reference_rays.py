"""Rays that photons are compared with: their density is the one they are said to have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("mitsuba")


@pytest.fixture(scope="module")
def surface(mitsuba: Any) -> Any:
    """A square of one side, large, and a small one of two sides above it."""
    from purelight_train.light.exit_surface import ExitSurface

    square = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
    positions = np.concatenate([square, 0.3 * square + [0, 0, 0.5]]).astype(np.float32)
    triangles = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)], np.uint32)
    return ExitSurface(positions, triangles, np.array([False, False, True, True]))


@pytest.fixture(scope="module")
def rays(surface: Any) -> Any:
    """Of a beam up from one triangle, and light from the small square's back."""
    from purelight_train.learning.reference_rays import ReferenceRays
    from purelight_train.light.exit_records import ExitRecords

    rng, count = np.random.default_rng(0), 1 << 14
    triangle = np.where(rng.random(count) < 0.7, 0, 3)
    normal = np.where(triangle[:, None] == 0, [0, 0, 1], [0, 0, -1]).astype(np.float32)
    direction = normal + np.where(triangle == 0, 0.05, 0.7)[:, None] * rng.normal(size=(count, 3))
    direction *= np.sign((direction * normal).sum(1))[:, None]
    direction = (direction / np.linalg.norm(direction, axis=1)[:, None]).astype(np.float32)
    position = surface.points_of(triangle, rng.random((2, count)))
    records = ExitRecords(
        position, normal, normal, direction, np.ones((count, 3), np.float32),
        np.full(count, np.inf, np.float32), np.zeros(count, bool), count,
    )  # fmt: skip
    return ReferenceRays.of(surface, records, triangle)


def fields(position: Any, normal: Any, outgoing: Any) -> np.ndarray:
    """Some functions of a ray, smooth and not: [N, F]."""
    x, y, z = position.T
    cosine = (normal * outgoing).sum(1)
    return np.stack([
        np.ones_like(x), cosine, cosine**30, (cosine > 0.995).astype(float), (z > 0.2) * 1.0,
        (normal[:, 2] < 0) * cosine, np.cos(3 * x) * outgoing[:, 0] * y, (x > y) * 1.0,
    ], 1)  # fmt: skip


def test_means_are_those_of_uniform_rays(surface: Any, rays: Any) -> None:
    """E_q[f / rho] = E_u[f] for all fields, within 4.5 standard errors."""
    rng, count = np.random.default_rng(1), 1 << 20
    *drawn, log_ratio = rays.sample(count, rng)
    told = fields(*drawn) / np.exp(log_ratio.astype(np.float64))[:, None]
    true = fields(*surface.sample_rays(count, rng))
    error = np.sqrt((told.var(0) + true.var(0)) / count)
    assert (np.abs(told.mean(0) - true.mean(0)) < 4.5 * error + 1e-9).all()


def test_rays_begin_on_the_surface_and_leave_it(surface: Any, rays: Any) -> None:
    position, normal, outgoing, _ = rays.sample(1 << 14, np.random.default_rng(2))
    np.testing.assert_allclose(np.linalg.norm(outgoing, axis=1), 1, atol=1e-5)
    assert ((normal * outgoing).sum(1) > 0).all()
    low = np.isclose(position[:, 2], 0)
    assert (normal[low, 2] == 1).all()  # One side of the large square, both of the small one.
    assert 0.1 < (normal[~low, 2] > 0).mean() < 0.9


def test_density_of_rays_is_told_alike(rays: Any) -> None:
    """Whether a ray was drawn or comes from elsewhere, as a photon does."""
    position, normal, outgoing, log_ratio = rays.sample(1 << 14, np.random.default_rng(3))
    x, y, z = position.T
    triangle = 2 * (z > 0.2) + (y > x)
    again = rays.log_ratio(position, normal, outgoing, triangle)
    same = np.isclose(again, log_ratio)
    assert same.mean() > 0.999  # Rounding moves a few into the next cell.


def test_light_is_drawn_more_often(rays: Any) -> None:
    up = np.eye(3, dtype=np.float32)[2:]
    at = np.array([[0.5, -0.5, 0], [-0.5, 0.5, 0]], np.float32)
    (beam,) = rays.log_ratio(at[:1], up, up, np.array([0]))
    (dark,) = rays.log_ratio(at[1:], up, up, np.array([1]))
    assert beam > np.log(20)
    assert dark == pytest.approx(np.log(0.5), abs=0.1)


def test_flux_is_of_the_rays_that_escape(rays: Any) -> None:
    """Above the small square all do; its back sees the large one, which takes what it meets."""
    from purelight_train.learning.flux_closure import escaping_flux

    def radiance(position: Any, normal: Any, outgoing: Any) -> np.ndarray:
        small = position[:, 2] > 0.2
        above, below = small & (normal[:, 2] > 0), small & (normal[:, 2] < 0)
        return np.stack([above, below, 0 * above], 1).astype(np.float32)

    parts: list[float] = []
    flux, error = escaping_flux(
        rays, radiance, np.random.default_rng(4), precision=0.02, progress=parts.append
    )
    whole = np.pi * 0.6**2
    assert abs(flux[0] - whole) < 4.5 * error[0]
    assert error[0] < flux[0] * 0.02
    assert 0.1 * whole < flux[1] < 0.7 * whole
    assert flux[2] == 0
    assert 0 < parts[0] <= 1
    assert parts[-1] == 1


def test_flux_ends_at_the_most_rays(rays: Any) -> None:
    """However far its precision is, which is then told by the rays."""
    from purelight_train.learning.flux_closure import PASS, escaping_flux

    def radiance(position: Any, normal: Any, outgoing: Any) -> np.ndarray:
        return np.ones_like(position)

    parts: list[float] = []
    rng = np.random.default_rng(5)
    escaping_flux(rays, radiance, rng, precision=1e-7, most=2 * PASS, progress=parts.append)
    assert parts == [0.5, 1]
