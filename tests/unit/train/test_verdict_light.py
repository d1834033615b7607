"""The verdict's measures on light whose errors are known: noise is taken out, none is hidden."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from purelight_format.measures import BoundingSphere
from purelight_train.truth.picture import Passes, Picture, mean
from purelight_train.verdict import light, shells
from purelight_train.verdict.detail import Scale, detail, join
from purelight_train.verdict.shells import SIDE, Shells

Image = NDArray[np.float64]
SPHERE = BoundingSphere((0.3, -0.2, 1.0), 0.05)
RADIANCE = np.array([3.0, 2.0, 0.5], np.float32)


def noisy(true: Image, noise: float, seed: int, passes: int = 8) -> Picture:
    """Passes whose mean has a relative noise."""
    rng, sums = np.random.default_rng(seed), Passes()
    for _ in range(passes):
        sums.add(true * (1 + noise * np.sqrt(passes) * rng.normal(size=true.shape)))
    return sums.picture()


def bright(seed: int = 0) -> Image:
    """Light that varies by hundreds from place to place."""
    rng = np.random.default_rng(seed)
    return np.exp(gaussian_filter(rng.normal(size=(192, 32, 3)), (4, 4, 0)) * 12)


# Shells


def test_cells_are_where_their_points_are() -> None:
    around = Shells(SPHERE)
    for radius, points in zip(around.radii, around.points(np.random.default_rng(0)), strict=True):
        offset = (points - np.asarray(SPHERE.center)) / SPHERE.radius
        np.testing.assert_allclose(np.linalg.norm(offset, axis=1), radius, rtol=1e-5)
        unit = offset / radius
        assert (shells.cells(unit) == np.arange(2 * SIDE * SIDE)).mean() > 0.999
        height = around.height()[: 2 * SIDE, :, 0].ravel()
        assert np.abs(unit[:, 2] - height).max() < 0.2
        assert (unit[: SIDE * SIDE, 2] <= 1e-6).all()


def test_cells_have_equal_areas() -> None:
    unit = np.random.default_rng(0).normal(size=(1 << 20, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    counts = np.bincount(shells.cells(unit), minlength=2 * SIDE * SIDE)
    assert counts.std() / counts.mean() < 1.1 * math.sqrt(2 * SIDE * SIDE / len(unit))


def test_light_arrives_where_rays_lead() -> None:
    """Rays from off the centre: each brings its power to the one cell that it meets."""
    around = Shells(SPHERE, (2.0, 7.0))
    rng = np.random.default_rng(1)
    target = around.points(rng)[1][::97]
    start = np.asarray(SPHERE.center) + SPHERE.radius * 0.5 * rng.normal(size=target.shape) / 2
    direction = target - start
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    power = rng.random((len(target), 3))
    caught = around.caught(start, direction, power).reshape(2, -1, 3)
    np.testing.assert_allclose(caught.sum(1), [power.sum(0)] * 2)
    np.testing.assert_allclose(caught[1, ::97], power)


# Errors of light


@pytest.mark.parametrize("noise", [0.0, 0.05, 0.1])
def test_an_error_is_found_below_its_noise(noise: float) -> None:
    """Places that are off by normal errors of 10 %: nine tenths are within 16 %."""
    true = bright()
    off = 1 + 0.1 * np.random.default_rng(5).normal(size=true.shape)
    found = light.error(noisy(off * true, noise / 2, 1), noisy(true, noise, 2))
    assert found.within == pytest.approx(0.1645, rel=0.12)
    assert found.noise == pytest.approx(1.645 * noise * math.sqrt(1.25), rel=0.12)


def test_nothing_is_claimed_that_noise_hides() -> None:
    true = bright()
    found = light.error(noisy(true, 0.05, 1), noisy(true, 0.05, 2))
    assert light.SURE * found.noise <= found.within < 0.75 * found.noise
    assert found.mean == pytest.approx(0, abs=0.01)


def test_most_of_the_light_decides_and_not_most_of_the_places() -> None:
    true = np.full((192, 32, 3), 1e-3)
    true[:8] = 1.0  # A spot with nearly all of the light.
    told = Picture.exact(np.where(true < 1, 3 * true, 1.02 * true))
    assert light.error(told, Picture.exact(true)).within == pytest.approx(0.02)
    told = Picture.exact(np.where(true < 1, true, 1.2 * true))
    assert light.error(told, Picture.exact(true)).within == pytest.approx(0.2)


def test_no_light_is_no_error() -> None:
    dark = Picture.exact(np.zeros((64, 32, 3)))
    with np.errstate(all="ignore"):
        assert light.ratio(dark.image, dark.image) == 0


def test_weighted_quantile() -> None:
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 8.0, 1.0])
    assert light.weighted_quantile(values, weights, 0.5) == 1
    assert light.weighted_quantile(values, weights, 0.85) == 2
    assert light.weighted_quantile(values, weights, 1.0) == 3


def test_pictures_are_averaged_and_joined() -> None:
    one, two = noisy(bright(), 0.1, 1), noisy(bright(), 0.1, 2)
    both = mean([one, two])
    np.testing.assert_allclose(both.image, (one.image + two.image) / 2)
    np.testing.assert_allclose(both.image, (both.halves[0] + both.halves[1]) / 2)
    assert both.error.mean() == pytest.approx(one.error.mean() / math.sqrt(2), rel=0.05)
    long = join([one, two])
    np.testing.assert_array_equal(long.halves[1][192:], two.halves[1])


# Detail

EYE, LIGHT = Scale(2, 8, eye=True), Scale(2, 8)


def scenery(kept: float) -> tuple[Image, Image]:
    """Detail of 2 x 2 cells in neighbourhoods of many levels, and the same with a part of it."""
    rng = np.random.default_rng(3)
    level = np.kron(np.exp(rng.normal(size=(48, 16, 1))), np.ones((8, 8, 1)))
    fine = np.kron(rng.normal(size=(192, 64, 1)), np.ones((2, 2, 1)))
    coarse = np.kron(fine.reshape(48, 8, 16, 8, 1).mean((1, 3)), np.ones((8, 8, 1)))
    contrast = 0.2 * (fine - coarse)
    picture, changed = (level * (1 + c) for c in (contrast, kept * contrast))
    return np.repeat(picture, 3, -1), np.repeat(changed, 3, -1)


@pytest.mark.parametrize("scale", [EYE, LIGHT])
@pytest.mark.parametrize("kept", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_what_is_kept_of_detail_is_found_in_noise(scale: Scale, kept: float, noise: float) -> None:
    true, told = scenery(kept)
    where = np.ones(true.shape[:2], bool)
    found = detail(noisy(told, noise, 1), noisy(true, noise, 2), scale, where)
    assert found.kept == pytest.approx(kept, abs=max(3 * found.error, 0.03))
    assert found.error < 0.05
    if scale is LIGHT:
        assert found.contrast == pytest.approx(0.2, rel=0.1)


def test_detail_beside_the_lamp_does_not_count() -> None:
    true, told = scenery(0.3)
    where = np.zeros(true.shape[:2], bool)
    where[:, 40:] = True
    told[:, :40] = true[:, :40] = np.random.default_rng(0).random((384, 40, 3)) * 100
    found = detail(Picture.exact(told), Picture.exact(true), EYE, where)
    assert found.kept == pytest.approx(0.3, abs=0.01)


def test_a_lamp_without_detail_has_lost_none() -> None:
    even = Picture.exact(np.ones((64, 64, 3)))
    where = np.ones((64, 64), bool)
    found = detail(even, even, EYE, where)
    assert (found.kept, found.contrast) == (1.0, 0.0)
    ones = np.ones((64, 64, 3))
    found = detail(noisy(ones, 0.1, 1), noisy(ones, 0.3, 2), EYE, where)
    assert (found.kept, found.error) == (1.0, 0.0)


@pytest.mark.parametrize("kept", [0.0, 0.6, 1.0])
@pytest.mark.parametrize("noise", [0.2, 0.5, 1.0])
def test_noise_of_the_truth_says_nothing_of_what_is_kept(kept: float, noise: float) -> None:
    """Neither more nor less, in the mean of many truths; nor more surely than it is known."""
    true, told = scenery(kept)
    where = np.ones(true.shape[:2], bool)
    found = [
        detail(Picture.exact(told), noisy(true, noise, seed), EYE, where) for seed in range(40)
    ]
    known = np.array([each.kept for each in found])
    errors = np.array([each.error for each in found])
    assert (errors > 0).all()
    assert abs(known.mean() - kept) < 3 * known.std() / math.sqrt(40) + 0.03
    assert (np.abs(known - kept) < 4 * errors + 0.03).mean() > 0.9


@pytest.mark.parametrize("noise", [0.0, 0.2, 0.5])
def test_what_is_lost_in_places_counts_like_what_is_kept_in_others(noise: float) -> None:
    """However noisy the truth is; for weights by what is told alone the lost half is nearly all."""
    true, told = scenery(1.0)
    told[:, :64] = scenery(0.0)[1][:, :64]
    where = np.ones(true.shape[:2], bool)
    found = detail(Picture.exact(told), noisy(true, noise, 4), EYE, where)
    assert found.kept == pytest.approx(0.5, abs=max(3 * found.error, 0.05))
    assert found.error < 0.1


# Pictures


def test_detail_too_faint_to_be_seen_hides_no_coarser_one() -> None:
    rng = np.random.default_rng(5)
    patches = np.kron(1 + 0.3 * rng.normal(size=(24, 8, 1)).clip(-2, 2), np.ones((8, 8, 3)))
    true, told = Picture.exact(patches), Picture.exact(np.ones_like(patches))
    part, found = looked(told, true).detail
    assert part == 4 / 128
    assert found.kept == pytest.approx(0, abs=0.05)


def looked(told: Picture, true: Picture) -> Any:
    from purelight_train.verdict.look import Look, View

    mask = np.ones(true.image.shape[:2], bool)
    lens: Any = None
    return Look([View(lens, true, told, mask)])


def test_haze_is_light_in_dark_parts(mitsuba: Any) -> None:
    """A lamp of which half is dark: light there counts beside a wall's, a hundredth of its own."""
    true = np.full((128, 128, 3), 1.0)
    true[:, 64:] = 0.02  # The mean is 0.51.
    told = true.copy()
    told[:, 64:] += 0.03
    found = looked(noisy(told, 0.02, 1), noisy(true, 0.3, 2))
    assert found.haze == pytest.approx(0.03 / (0.02 + 0.0051), rel=0.05)
    assert looked(Picture.exact(true), noisy(true, 0.3, 3)).haze == pytest.approx(0, abs=0.03)
    even = Picture.exact(np.ones((128, 128, 3)))
    assert looked(even, even).haze == 0


def test_pictures_differ_by_parts_of_their_mean(mitsuba: Any) -> None:
    true = np.exp(np.random.default_rng(0).normal(size=(128, 128, 3)))
    found = looked(noisy(1.25 * true, 0.05, 1), noisy(true, 0.05, 2))
    error, noise = found.error
    assert error == pytest.approx(0.25, rel=0.05)
    assert noise < 0.03


# Light that arrives of a ball of one radiance: pi L R² / D²


def even(position: Any, *_: Any) -> Any:
    return np.broadcast_to(RADIANCE, position.shape).copy()


@pytest.fixture(scope="module")
def surface(mitsuba: Any) -> Any:
    import trimesh

    from purelight_train.light.exit_surface import ExitSurface

    ball = trimesh.creation.icosphere(subdivisions=5, radius=SPHERE.radius)
    positions = (ball.vertices + np.asarray(SPHERE.center)).astype(np.float32)
    return ExitSurface(positions, ball.faces.astype(np.uint32), np.zeros(len(ball.faces), bool))


def test_the_light_of_a_map_is_that_of_its_cells(surface: Any) -> None:
    from purelight_train.verdict import arriving

    def fast_map(point: Any) -> Any:
        return np.broadcast_to(RADIANCE, (len(point), 16, 16, 3))

    found = arriving.of_map(Shells(SPHERE), fast_map, np.random.default_rng(0))
    power = 4 * math.pi**2 * SPHERE.radius**2 * RADIANCE / (2 * SIDE * SIDE)
    np.testing.assert_allclose(found.image, np.broadcast_to(power, found.image.shape), rtol=1e-3)


def test_grain_is_the_variance_of_a_shadow_ray(surface: Any) -> None:
    """Even directions of the cap: only half of them meet a smaller ball."""
    from purelight_format.measures import cap, cap_to_direction
    from purelight_train.verdict import arriving

    wide = BoundingSphere(SPHERE.center, SPHERE.radius * math.sqrt(2))
    around = Shells(wide, (8.0,))

    def sample(point: Any, u: Any) -> Any:
        seen = cap(point.astype(np.float64), wide)
        return cap_to_direction(u.astype(np.float64), seen).astype(np.float32), 1 / seen.solid_angle

    given = Picture.exact(np.ones((2 * SIDE, SIDE, 3)))
    found = arriving.grain(around, given, surface, even, sample, np.random.default_rng(0))
    assert found == pytest.approx(1.0, abs=0.1)  # p / (1 - p) of p = 1/2
