"""The conventions: frames, equal-area maps and caps, with their hard cases."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_format.color import LUMINANCE
from purelight_format.measures import (
    BoundingSphere,
    Cap,
    cap,
    cap_to_direction,
    direction_to_cap,
    disk_to_square,
    draw_from_map,
    encode_point,
    flux_estimate,
    frame,
    light_estimate,
    square_to_disk,
)

SPHERE = BoundingSphere((0.3, -0.2, 1.1), 0.4)
EDGE = [0.0, 2.0**-24, 0.25, 0.5, 0.75, 1 - 2.0**-24, 1.0]
RADII = [1 + 2e-6, 1.01, 1.5, 3, 15, 1e3, 1e6]


def axes(dtype: type = np.float64) -> np.ndarray:
    """Random axes, the coordinate axes, and some that nearly point down."""
    axis = np.random.default_rng(1).standard_normal((500, 3))
    tilt = np.array([[s, -s, -1] for s in (1e-2, 1e-4, 1e-6, 1e-9, 1e-11)])
    axis = np.concatenate((axis, np.eye(3), -np.eye(3), tilt))
    return (axis / np.linalg.norm(axis, axis=1, keepdims=True)).astype(dtype)


def squares() -> np.ndarray:
    grid = np.stack(np.meshgrid(EDGE, EDGE), -1).reshape(-1, 2)
    return np.concatenate((grid, np.random.default_rng(2).random((2000, 2))))


def points(radii: list[float], count: int = 40) -> np.ndarray:
    """Points at distances from the centre, the directly lower and upper ones first."""
    direction = np.random.default_rng(3).standard_normal((len(radii), count, 3))
    direction[:, 0], direction[:, 1] = (0, 0, 1), (0, 0, -1)
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    offset = SPHERE.radius * np.array(radii)[:, None, None] * direction
    return (SPHERE.center + offset).reshape(-1, 3)


def paired(u: np.ndarray, view: Cap) -> tuple[np.ndarray, Cap]:
    """Every square coordinate with every cap."""
    index = np.repeat(np.arange(len(view.axis)), len(u))
    many = Cap(view.axis[index], view.one_minus_cos[index], view.outside[index])
    return np.tile(u, (len(view.axis), 1)), many


POLE = 5e-10  # Axes within 1e-10 of -Z take its frame, which is not quite theirs.


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, POLE), (np.float32, 1e-6)])
def test_frames_are_right_handed_and_orthonormal(dtype: type, tolerance: float) -> None:
    axis = axes(dtype)
    tangent, bitangent = frame(axis)
    assert tangent.dtype == bitangent.dtype == dtype
    basis = np.stack((tangent, bitangent, axis), -1).astype(np.float64)
    gram = np.einsum("nij,nik->njk", basis, basis)
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=tolerance)
    np.testing.assert_allclose(np.linalg.det(basis), 1, atol=tolerance)


def test_the_frame_of_the_singular_axis_is_the_stated_one() -> None:
    tangent, bitangent = frame(np.array([[0.0, 0.0, -1.0]]))
    np.testing.assert_array_equal((tangent[0], bitangent[0]), ([-1, 0, 0], [0, 1, 0]))


def test_square_and_disk_are_inverse() -> None:
    u = squares()
    disk = square_to_disk(u)
    assert ((disk**2).sum(1) <= 1 + 1e-12).all()
    np.testing.assert_allclose(disk_to_square(disk), u, atol=1e-12)


def test_the_disk_map_keeps_areas() -> None:
    """The Jacobian determinant by central differences is pi everywhere off the diagonals."""
    u, h = np.random.default_rng(4).uniform(0.01, 0.99, (4000, 2)), 1e-6
    across = np.abs(np.abs(u[:, 0] - 0.5) - np.abs(u[:, 1] - 0.5)) > 1e-3
    u = u[across]
    columns = [(square_to_disk(u + e) - square_to_disk(u - e)) / (2 * h) for e in np.eye(2) * h]
    determinant = np.linalg.det(np.stack(columns, -1))
    np.testing.assert_allclose(np.abs(determinant), np.pi, rtol=1e-6)


def test_a_cap_has_the_half_angle_of_its_sphere() -> None:
    distance = np.repeat(np.array(RADII), 40)
    expected = 1 - np.sqrt(1 - distance.astype(np.longdouble) ** -2)
    view = cap(points(RADII), SPHERE)
    np.testing.assert_allclose(view.one_minus_cos[: 40 * 5], expected[: 40 * 5], rtol=1e-8)
    np.testing.assert_allclose(view.one_minus_cos[-40:], 0.5e-12, rtol=1e-6)
    assert view.outside.all()


@pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-9), (np.float32, 2e-3)])
def test_cap_maps_are_inverse(dtype: type, tolerance: float) -> None:
    inner = squares()[len(EDGE) ** 2 :][:200]
    view = cap(points(RADII[:5]).astype(dtype), SPHERE)
    u, many = paired(inner.astype(dtype), view)
    toward = cap_to_direction(u, many)
    assert toward.dtype == dtype
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1, atol=1e-6)
    square, inside = direction_to_cap(toward, many)
    well_inside = ((2 * u - 1) ** 2).max(1) < 0.99
    assert inside[well_inside].all()
    np.testing.assert_allclose(square, u, atol=tolerance)


def test_directions_of_a_cap_meet_its_sphere() -> None:
    point = points(RADII[1:5])
    u, many = paired(squares(), cap(point, SPHERE))
    toward = cap_to_direction(u, many)
    offset = np.repeat(SPHERE.center - point, len(squares()), 0)
    miss = np.linalg.norm(np.cross(offset, toward), axis=1)
    assert (miss <= SPHERE.radius * (1 + 1e-9)).all()
    assert ((offset * toward).sum(1) > 0).all()


def test_the_cap_map_keeps_areas() -> None:
    """The mean of a smooth function over the square is its mean over the cap, by quadrature."""
    n = 256
    cells = (np.stack(np.meshgrid(np.arange(n), np.arange(n)), -1).reshape(-1, 2) + 0.5) / n
    for ratio in (1.01, 2.0, 50.0):
        view = cap(np.array([[0.0, 0.0, -ratio]]), BoundingSphere((0.0, 0.0, 0.0), 1.0))
        toward = cap_to_direction(*paired(cells, view))
        low = 1 - view.one_minus_cos[0]
        assert toward[:, 2].mean() == pytest.approx((1 + low) / 2, rel=5e-5)
        assert (toward[:, 2] ** 2).mean() == pytest.approx((1 + low + low**2) / 3, rel=5e-5)
        np.testing.assert_allclose(toward[:, :2].mean(0), 0, atol=1e-6)
        np.testing.assert_allclose(view.solid_angle, 2 * np.pi * (1 - low))


def test_directions_beside_a_cap_are_outside() -> None:
    view = cap(points(RADII), SPHERE)
    tangent, _ = frame(view.axis)
    theta = 1.01 * np.arccos(1 - view.one_minus_cos)
    beside = np.cos(theta)[:, None] * view.axis + np.sin(theta)[:, None] * tangent
    wide = view.one_minus_cos > 1e-10
    for toward in (beside, -view.axis, tangent):
        square, inside = direction_to_cap(toward, view)
        assert not inside[wide].any()
        assert np.isfinite(square).all()
        assert ((square >= 0) & (square <= 1)).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_in_and_on_the_sphere_are_served_finitely(dtype: type) -> None:
    point = points([0.0, 1e-9, 0.5, 1 - 1e-7, 1.0]).astype(dtype)
    view = cap(point, SPHERE)
    assert not view.outside[: 40 * 3].any()
    np.testing.assert_array_equal(view.one_minus_cos[: 40 * 3], 1)
    np.testing.assert_allclose(np.linalg.norm(view.axis, axis=1), 1, rtol=1e-6)
    at_centre = cap(np.array([SPHERE.center], dtype), SPHERE)
    np.testing.assert_array_equal(at_centre.axis, [[0, 0, 1]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("radius", [1e-4, 1.0, 1e5])
def test_far_points_keep_their_density(dtype: type, radius: float) -> None:
    sphere = BoundingSphere((0.0, 0.0, 0.0), radius)
    point = np.array([[0, 0, -1e6], [1e20, 0, 0], [-1e30, 1e30, 0]], dtype) * dtype(radius)
    view = cap(point, sphere)
    assert (view.solid_angle > 0).all()
    assert view.solid_angle[0] == pytest.approx(np.pi * 1e-12, rel=5e-5)
    toward = cap_to_direction(np.full((3, 2), 0.3, dtype), view)
    assert np.isfinite(1 / view.solid_angle).all()
    np.testing.assert_allclose(np.linalg.norm(toward, axis=1), 1, rtol=1e-6)


def test_encoded_points_fill_the_cube_and_stop_at_r_max() -> None:
    place, t = encode_point(points([0.5, 1.0, 15.0, 1e6]), SPHERE, 15.0)
    length = np.linalg.norm(2 * place - 1, axis=1).reshape(4, 40)
    np.testing.assert_allclose(length, np.array([0.5, 0.5, 1, 1])[:, None] + np.zeros(40))
    angle = 2 / np.pi * np.arcsin(1 / 15)
    np.testing.assert_allclose(t.reshape(4, 40)[:, 0], [1, 1, angle, angle], rtol=1e-7)
    centre, _ = encode_point(np.array([SPHERE.center]), SPHERE, 15.0)
    np.testing.assert_array_equal(centre, [[0.5, 0.5, 0.5]])
    x, y, z = SPHERE.center
    away, _ = encode_point(np.array([[x + 15 * SPHERE.radius, y, z]]), SPHERE, 15.0)
    np.testing.assert_allclose(away, [[1, 0.5, 0.5]])


def test_directions_from_a_map_have_the_stated_density() -> None:
    rng, count = np.random.default_rng(5), 4000
    cells = rng.random((16, 16, 3)) * (rng.random((16, 16, 1)) < 0.3)
    view = cap(np.repeat(points([1.5])[2:3], count, 0), SPHERE)
    radiance_map = np.broadcast_to(cells, (count, 16, 16, 3))
    radiance, toward, pdf = draw_from_map(radiance_map, rng.random((count, 2)), view)
    square, inside = direction_to_cap(toward, view)
    column, row = np.minimum(16 * square, 15).astype(int).T
    assert inside.all()
    np.testing.assert_array_equal(radiance, cells[row, column])
    luminance = cells @ LUMINANCE
    density = 256 * luminance[row, column] / luminance.sum()
    np.testing.assert_allclose(pdf * view.solid_angle, density)
    drawn = np.bincount(16 * row + column, minlength=256) / count
    expected = (luminance / luminance.sum()).ravel()
    assert np.abs(drawn - expected).max() < 5 * np.sqrt(expected.max() / count)


@pytest.mark.parametrize(("level", "distance"), [(0.0, 2.0), (1.0, 0.5)])
def test_nothing_is_drawn_from_black_maps_or_inside(level: float, distance: float) -> None:
    view = cap(points([distance], 8), SPHERE)
    radiance, toward, pdf = draw_from_map(
        np.full((8, 16, 16, 3), level), np.full((8, 2), 0.4), view
    )
    np.testing.assert_array_equal(pdf, 0)
    np.testing.assert_array_equal(light_estimate(radiance, toward[:, 2], pdf), 0)


def test_estimates_have_the_mean_of_a_shining_ball() -> None:
    """Irradiance pi L (R/d)² that faces it, and flux pi L times its area."""
    rng, level, ratio = np.random.default_rng(6), np.array([3.0, 2.0, 1.0]), 1.5
    view = cap(np.repeat(points([ratio])[2:3], 20_000, 0), SPHERE)
    toward = cap_to_direction(rng.random((20_000, 2)), view)
    cosine = (toward * view.axis).sum(1)
    radiance = np.broadcast_to(level, toward.shape)
    light = light_estimate(radiance, cosine, 1 / view.solid_angle).mean(0)
    np.testing.assert_allclose(light, np.pi * level / ratio**2, rtol=5e-3)
    area = 4 * np.pi * SPHERE.radius**2
    flux = flux_estimate(radiance, 1 / area, np.full(len(toward), 1 / np.pi)).mean(0)
    np.testing.assert_allclose(flux, np.pi * level * area)


def test_no_points_are_no_trouble() -> None:
    view = cap(np.zeros((0, 3)), SPHERE)
    assert cap_to_direction(np.zeros((0, 2)), view).shape == (0, 3)
