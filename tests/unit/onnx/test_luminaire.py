"""A luminaire's queries, its lazy networks, and its refusals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_onnx.luminaire import Luminaire

CENTRE = np.array([0.5, -1.0, 2.0])


def queries(rows: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(0)
    directions = rng.standard_normal((2, rows, 3))
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    return rng.random((rows, 3)), directions[0], directions[1]


@pytest.mark.parametrize("rows", [0, 1, 65537])
def test_radiance_hands_each_input_to_its_own_place(luminaire: Luminaire, rows: int) -> None:
    position, normal, outgoing = queries(rows)
    radiance = luminaire.radiance(position, normal, outgoing)
    assert radiance.shape == (rows, 3)
    expected = position - CENTRE + 2 * outgoing + 3 * normal
    np.testing.assert_allclose(radiance, expected, atol=1e-5)


def test_sample_returns_direction_and_pdf(luminaire: Luminaire) -> None:
    toward, pdf = luminaire.sample(np.array([[7.0, 8.0, 9.0]]), np.array([[0.25, 0.5]]))
    np.testing.assert_array_equal(toward, [[0.25, 0.5, 9.0]])
    np.testing.assert_array_equal(pdf, [7.0])


def test_a_network_is_loaded_at_its_first_use_and_once(bundle: Any) -> None:
    lamp = Luminaire(bundle)
    assert not bundle.reads
    lamp.radiance(*queries(2))
    lamp.radiance(*queries(3))
    assert bundle.reads == ["networks/appearance.onnx"]


def test_golden_vectors_that_hold_are_accepted(bundle: Any) -> None:
    Luminaire(bundle).transmittance(*queries(1))


@pytest.mark.parametrize("wrong", [1e-3, np.nan])
def test_a_golden_vector_that_fails_stops_the_network(bundle: Any, wrong: float) -> None:
    bundle.golden["appearance"].outputs["radiance"][1, 2] += wrong
    with pytest.raises(PureLightError, match="golden"):
        Luminaire(bundle).radiance(*queries(1))
    Luminaire(bundle, check_vectors=False).radiance(*queries(1))


def test_a_missing_network_is_named(luminaire: Luminaire) -> None:
    with pytest.raises(PureLightError, match="fast_map"):
        luminaire.radiance_map(np.zeros((1, 3)))


@pytest.mark.parametrize(
    ("position", "normal", "outgoing", "message"),
    [
        (np.zeros((2, 2)), np.eye(3)[:2], np.eye(3)[:2], "position"),
        (np.zeros(3), np.eye(3)[:1], np.eye(3)[:1], "position"),
        (np.array([[np.nan, 0, 0]]), np.eye(3)[:1], np.eye(3)[:1], "finite"),
        (np.array([[1e39, 0, 0]]), np.eye(3)[:1], np.eye(3)[:1], "finite"),
        (np.zeros((1, 3)), np.zeros((1, 3)), np.eye(3)[:1], "normal must have unit length"),
        (np.zeros((1, 3)), np.eye(3)[:1], 2 * np.eye(3)[:1], "outgoing must have unit length"),
        (np.zeros((2, 3)), np.eye(3)[:1], np.eye(3)[:1], "N the same"),
        (np.array([["a", "b", "c"]]), np.eye(3)[:1], np.eye(3)[:1], "numbers"),
    ],
)
def test_wrong_queries_are_refused_in_one_line(
    luminaire: Luminaire,
    position: np.ndarray,
    normal: np.ndarray,
    outgoing: np.ndarray,
    message: str,
) -> None:
    with pytest.raises(PureLightError, match=message) as caught:
        luminaire.radiance(position, normal, outgoing)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("u", [-0.1, 1.1])
def test_uniforms_outside_the_square_are_refused(luminaire: Luminaire, u: float) -> None:
    with pytest.raises(PureLightError, match="u must lie"):
        luminaire.sample(np.zeros((1, 3)), np.array([[0.5, u]]))
