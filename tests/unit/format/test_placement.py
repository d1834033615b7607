"""Transforms of lamps: what is taken apart, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from purelight_format.errors import PureLightError
from purelight_format.measures import Placement


def matrix(linear: np.ndarray) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3] = linear
    result[:3, 3] = 1, 2, 3
    return result


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_similarity_is_taken_apart(scale: float) -> None:
    rotation = Rotation.from_euler("xyz", [20, 130, -70], degrees=True).as_matrix()
    found = Placement.of(matrix(scale * rotation), "lamp")
    np.testing.assert_allclose(found.rotation, rotation, atol=1e-12)
    assert found.scale == pytest.approx(scale)
    points = np.random.default_rng(0).normal(size=(5, 3))
    expected = points @ (scale * rotation).T + [1, 2, 3]
    np.testing.assert_allclose(found.point_to_world(points), expected)
    np.testing.assert_allclose(found.point_to_local(expected), points, atol=1e-12)
    np.testing.assert_allclose(found.direction_to_world(points), points @ rotation.T, atol=1e-12)
    np.testing.assert_allclose(found.direction_to_local(points @ rotation.T), points, atol=1e-12)


def test_a_placement_calculates_in_its_type() -> None:
    found = Placement.of(matrix(2 * np.eye(3)), "lamp", np.float32)
    point = np.ones((2, 3), np.float32)
    for moved in (found.point_to_local(point), found.point_to_world(point)):
        assert moved.dtype == np.float32
    np.testing.assert_array_equal(found.point_to_local(found.point_to_world(point)), point)


@pytest.mark.parametrize(
    ("linear", "word"),
    [
        (np.diag([1.0, 1.0, 1.1]), "shears or scales"),
        (np.array([[1, 0.2, 0], [0, 1, 0], [0, 0, 1.0]]), "shears or scales"),
        (np.diag([1.0, 1.0, -1.0]), "mirrors"),
        (np.zeros((3, 3)), "flattens"),
        (np.full((3, 3), np.nan), "finite"),
    ],
)
def test_everything_else_is_refused(linear: np.ndarray, word: str) -> None:
    with pytest.raises(PureLightError, match=word) as error:
        Placement.of(matrix(linear), "lamp.plux")
    assert str(error.value).startswith("lamp.plux: ")
    assert "\n" not in str(error.value)


def test_a_projection_is_refused() -> None:
    projective = np.eye(4)
    projective[3, 2] = 0.1
    with pytest.raises(PureLightError, match="affine"):
        Placement.of(projective, "lamp")


def test_the_limit_is_that_of_the_spec() -> None:
    """H6: more than 1e-4 off a rotation, and 1e-8 off an affine transform."""
    Placement.of(matrix(np.diag([1, 1, 1 + 7.4e-5])), "lamp")
    with pytest.raises(PureLightError, match="shears or scales"):
        Placement.of(matrix(np.diag([1, 1, 1 + 7.6e-5])), "lamp")
    projective = matrix(np.eye(3))
    projective[3] = 0, 0, 1e-7, 1
    with pytest.raises(PureLightError, match="affine"):
        Placement.of(projective, "lamp")
