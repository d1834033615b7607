"""Irradiance by the three estimators: of a lamp whose light is known, and of each other."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_conformance.lamps import LAMPS
from purelight_format.errors import PureLightError
from purelight_onnx import Luminaire, irradiance, lighting
from purelight_onnx.exit_surface import ExitSurface

COUNT = 1 << 15
SIGMAS = 4.5  # Chance is blamed once in 50,000 comparisons of 3 channels each.


@pytest.fixture(scope="module")
def wild(tmp_path_factory: pytest.TempPathFactory) -> Luminaire:
    path = tmp_path_factory.mktemp("lamps") / "wild.plux"
    LAMPS["wild"].write(path)
    return Luminaire.open(path)


@pytest.fixture(scope="module")
def paint(tmp_path_factory: pytest.TempPathFactory) -> Luminaire:
    path = tmp_path_factory.mktemp("lamps") / "paint.plux"
    LAMPS["paint"].write(path)
    return Luminaire.open(path)


def samples(
    luminaire: Luminaire, estimator: lighting.Estimator, point: np.ndarray, normal: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard error of an estimator: [3] each."""
    u = np.random.default_rng(1).random((COUNT, 2))
    rows = np.tile(point, (COUNT, 1)), np.tile(normal, (COUNT, 1))
    found = estimator(luminaire, *rows, u)
    return found.mean(0), found.std(0) / np.sqrt(COUNT)


@pytest.mark.parametrize("radii", [1.3, 2.0, 8.0])
def test_sampler_and_surface_agree(wild: Luminaire, radii: float) -> None:
    """Two densities of directions, one light: both must know their measure."""
    sphere = wild.manifest.bounding_sphere
    away = np.array([0.6, -0.48, 0.64])
    point, normal = sphere.center + radii * sphere.radius * away, -away
    first, first_error = samples(wild, lighting.by_sampler, point, normal)
    second, second_error = samples(wild, lighting.by_surface, point, normal)
    assert (np.hypot(first_error, second_error) < 0.05 * first).all()
    assert (np.abs(first - second) < SIGMAS * np.hypot(first_error, second_error)).all()


def test_light_all_around(paint: Luminaire) -> None:
    """Inside a closed lamp of even radiance L, every surface has the irradiance pi L."""
    centre = paint.manifest.bounding_sphere.center
    for normal in ([0, 0, 1.0], [0.6, 0, -0.8]):
        found = irradiance(paint, centre, normal, samples=COUNT)
        np.testing.assert_allclose(found, np.pi * np.array([3.0, 2.0, 1.0]), rtol=0.03)


def test_the_even_map(paint: Luminaire) -> None:
    """A cap of even radiance straight ahead gives pi L (R/d)²."""
    sphere = paint.manifest.bounding_sphere
    point = np.array(sphere.center) - [0, 0, 3 * sphere.radius]
    found = irradiance(paint, point, [0, 0, 1.0], mode="fast", samples=COUNT)
    np.testing.assert_allclose(found, np.pi * np.array([3.0, 2.0, 1.0]) / 9, rtol=0.01)
    assert not irradiance(paint, point, [0, 0, -1.0], mode="fast", samples=64).any()


def test_many_points_at_once(wild: Luminaire) -> None:
    sphere = wild.manifest.bounding_sphere
    point = sphere.center - sphere.radius * np.array([[0, 0, 4.0], [0, 0, 0.1]])
    light = irradiance(wild, point, np.tile([0, 0, 1.0], (2, 1)), samples=256)
    assert light.shape == (2, 3)
    np.testing.assert_array_equal(light[0], irradiance(wild, point[0], [0, 0, 1.0], samples=256))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"mode": "quick"}, "neither accurate nor fast"),
        ({"samples": 0}, "at least 1"),
        ({"normal": [[0, 0, 1.0]] * 2}, "must both be"),
        ({"point": [0, 0, np.nan]}, "point must be finite"),
        ({"point": [0, np.inf, 0]}, "point must be finite"),
        ({"normal": [0, 0, 0.0]}, "unit length"),
        ({"normal": [0, 0, 2.0]}, "unit length"),
        ({"normal": [np.nan, 0, 1.0]}, "unit length"),
    ],
)
def test_what_is_refused(paint: Luminaire, arguments: dict[str, object], text: str) -> None:
    call = {"point": [0, 0, -1.0], "normal": [0, 0, 1.0], **arguments}
    with pytest.raises(PureLightError, match=text):
        irradiance(paint, **call)  # type: ignore[arg-type]


def test_points_are_even_on_triangles(wild: Luminaire) -> None:
    surface: ExitSurface = wild.exit_surface
    u = np.random.default_rng(2).random((COUNT, 2))
    found = surface.point(np.zeros(COUNT, int), u)
    middle = surface.centre + surface.radius * surface.corner[0].mean(0)
    error = found.std(0) / np.sqrt(COUNT)
    assert (np.abs(found.mean(0) - middle) < SIGMAS * error).all()
