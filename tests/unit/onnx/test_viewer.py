"""The camera, the exit surface, and the reference picture."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from purelight_format.camera import Camera
from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_format.measures import BoundingSphere
from purelight_format.members.surface import Surface
from purelight_onnx.exit_surface import ExitSurface
from purelight_onnx.luminaire import Luminaire
from purelight_onnx.viewer import render

SPHERE = BoundingSphere((0.5, -1.0, 2.0), 0.2)
CENTRE = np.array(SPHERE.center)


def view(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    return camera.rays(np.arange(camera.size**2), np.random.default_rng(0))


@pytest.mark.parametrize("elevation", [-90.0, 0.0, 30.0, 90.0])
def test_the_middle_ray_meets_the_centre(elevation: float) -> None:
    camera = Camera.orbit(SPHERE, azimuth=40, elevation=elevation, size=1001)
    origin, direction = camera.rays(np.array([500 * 1001 + 500]), np.random.default_rng(0))
    along = (CENTRE - origin) @ direction[0]
    nearest = origin + along[:, None] * direction
    np.testing.assert_allclose(nearest[0], CENTRE, atol=1e-3)


def test_the_picture_is_upright_and_not_mirrored() -> None:
    camera = Camera.orbit(SPHERE, azimuth=0, elevation=0, size=64)
    origin, direction = view(camera)
    assert (origin[:, 0] > CENTRE[0]).all()
    grid = direction.reshape(64, 64, 3)
    assert (grid[0, :, 2] > 0).all()
    assert (grid[-1, :, 2] < 0).all()
    assert (grid[:, -1, 1] > 0).all()


def test_a_lens_keeps_the_centre_in_focus() -> None:
    camera = Camera.orbit(SPHERE, distance=3, lens=0.5, size=1001)
    origin, direction = camera.rays(np.full(100, 500 * 1001 + 500), np.random.default_rng(0))
    assert np.linalg.norm(origin - camera.origin, axis=1).max() > 0.05
    along = ((CENTRE - origin) * direction).sum(1, keepdims=True)
    np.testing.assert_allclose(origin + along * direction, np.tile(CENTRE, (100, 1)), atol=1e-3)


@pytest.mark.parametrize(
    "options",
    [
        {"elevation": 91},
        {"azimuth": np.nan},
        {"distance": 1},
        {"distance": np.inf},
        {"size": 0},
        {"lens": -1},
        {"lens": 5},
    ],
)
def test_impossible_cameras_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(PureLightError):
        Camera.orbit(SPHERE, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e6])
def test_hits_lie_on_the_ball_and_face_the_viewer(bundle: Any, scale: float) -> None:
    surface, sphere = bundle.surface(), BoundingSphere(SPHERE.center, SPHERE.radius * scale)
    positions = (CENTRE + (surface.positions - CENTRE) * scale).astype(np.float32)
    scaled = Surface(positions, surface.triangles, surface.triangle_flux)
    origin, direction = view(Camera.orbit(sphere, size=64))
    hits = ExitSurface(scaled, sphere).intersect(origin, direction)
    radius = np.linalg.norm(hits.position - CENTRE, axis=1)
    assert 0.6 < len(hits.ray) / len(origin) < 0.8
    assert np.abs(radius / sphere.radius - 1).max() < 5e-3
    assert ((hits.normal * direction[hits.ray]).sum(1) < 0).all()
    np.testing.assert_allclose(np.linalg.norm(hits.normal, axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("radii", [1e3, 1e5, 1e7])
def test_rays_from_afar_meet_what_rays_from_nearby_meet(bundle: Any, radii: float) -> None:
    surface, rng = ExitSurface(bundle.surface(), SPHERE), np.random.default_rng(3)
    target = CENTRE + SPHERE.radius * rng.uniform(-0.6, 0.6, (1000, 3))
    direction = rng.standard_normal((1000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    near = surface.intersect(target - 4 * SPHERE.radius * direction, direction)
    far = surface.intersect(target - radii * SPHERE.radius * direction, direction)
    np.testing.assert_array_equal(far.ray, near.ray)
    np.testing.assert_allclose(far.position, near.position, atol=1e-5 * SPHERE.radius)


def test_both_sides_of_a_sheet_and_no_side_of_a_line() -> None:
    corners = np.array([[0, -1, -1], [0, 1, -1], [0, 0, 1], [0, 0, 1]], np.float32)
    triangles = np.array([[0, 1, 2], [2, 3, 2]], np.uint32)
    sheet = Surface(corners, triangles, np.ones((2, 3), np.float32))
    surface = ExitSurface(sheet, BoundingSphere((0.0, 0.0, 0.0), 2.0))
    origin, direction = np.array([[3.0, 0, 0], [-3.0, 0, 0]]), np.array([[-1.0, 0, 0], [1.0, 0, 0]])
    hits = surface.intersect(origin, direction)
    np.testing.assert_allclose(hits.normal, [[1, 0, 0], [-1, 0, 0]])


def test_the_picture_composites_over_the_background(luminaire: Luminaire) -> None:
    camera = Camera.orbit(SPHERE, azimuth=0, elevation=0, size=33)
    plain = render(luminaire, camera, samples=2)
    lit = render(luminaire, camera, samples=2, background=(4.0, 4.0, 4.0))
    np.testing.assert_allclose(lit[0, 0], 4.0)
    np.testing.assert_allclose(lit[16, 16] - plain[16, 16], [1.0, 2.0, 3.0], rtol=1e-5)
    np.testing.assert_allclose(plain[16, 16], [5.2, 0.0, 0.0], atol=0.15)
    assert not plain[0, 0].any()


def test_a_picture_of_no_rays_is_refused(luminaire: Luminaire) -> None:
    with pytest.raises(PureLightError, match="samples must be at least 1"):
        render(luminaire, Camera.orbit(SPHERE, size=4), samples=0)


def test_progress_counts_every_ray(luminaire: Luminaire) -> None:
    done: list[int] = []
    render(luminaire, Camera.orbit(SPHERE, size=300), samples=2, progress=done.append)
    assert sum(done) == 2 * 300 * 300
    assert max(done) <= 1 << 16


def test_answers_that_are_no_numbers_are_dark_and_told(
    luminaire: Luminaire, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = Camera.orbit(luminaire.manifest.bounding_sphere, size=16)
    right = render(luminaire, camera, samples=2)
    real = luminaire.radiance

    def spoilt(*query: np.ndarray) -> np.ndarray:
        radiance = real(*query)
        radiance[::2] = np.nan
        radiance[1::4] = np.inf
        return radiance

    monkeypatch.setattr(luminaire, "radiance", spoilt)
    with pytest.warns(SpoiltWarning, match=r"^\d+ answers"):
        picture = render(luminaire, camera, samples=2)
    assert np.isfinite(picture).all()
    assert 0 < picture.sum() < right.sum()
