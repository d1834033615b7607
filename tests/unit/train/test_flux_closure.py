"""Light of a field made the traced light, by direction: exponential tilting."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from purelight_train.learning.flux_closure import (
    DirectionalLight,
    bounded,
    by_direction,
    cell_directions,
    moments_of,
    tilt,
)
from purelight_train.networks.encodings import SphericalHarmonics

TOWARD = cell_directions()
HARMONICS = SphericalHarmonics(5)(torch.from_numpy(TOWARD).float()).double().numpy()
MANY = 1e12


def downwards(steep: float) -> np.ndarray:
    """Light that grows towards -Z: [K]."""
    return np.exp(-steep * TOWARD[:, 2])


def tilted_to(told: np.ndarray, traced: np.ndarray, records: float) -> np.ndarray:
    moments = moments_of(lambda part: HARMONICS[part], traced[:, None])[0]
    return tilt(told, HARMONICS, moments, records)


def test_directions_lie_in_their_own_cells() -> None:
    power = np.arange(3.0 * len(TOWARD)).reshape(-1, 3)
    np.testing.assert_array_equal(by_direction(TOWARD, power), power)


def test_no_light_is_lost_between_cells() -> None:
    rng = np.random.default_rng(0)
    direction = np.concatenate([rng.normal(size=(1000, 3)), np.eye(3), -np.eye(3)])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    power = rng.random((len(direction), 3))
    np.testing.assert_allclose(by_direction(direction, power).sum(0), power.sum(0))


def test_light_of_the_same_family_becomes_equal() -> None:
    told, traced = downwards(0.1), downwards(0.4)
    tilted = told * np.exp(HARMONICS @ tilted_to(told, traced, MANY))
    np.testing.assert_allclose(tilted / told.sum(), traced / traced.sum(), rtol=1e-4)


@pytest.mark.parametrize("width", [0.5, 0.05])
def test_moments_become_equal(width: float) -> None:
    """Also of a beam so narrow that all harmonics are nearly the same there."""
    told = np.exp((TOWARD[:, 2] - 1) / width) * (1 + 0.3 * TOWARD[:, 0])
    traced = np.exp((TOWARD[:, 2] - 1) / width) * (1 - 0.2 * TOWARD[:, 0])
    tilted = told / told.sum() * np.exp(HARMONICS @ tilted_to(told, traced, MANY))
    moments = HARMONICS.T @ (traced / traced.sum())
    np.testing.assert_allclose(HARMONICS.T @ tilted, moments, atol=1e-4)


def test_few_records_change_little_and_never_the_flux() -> None:
    told, traced = downwards(0.0), downwards(0.5)
    few, many = (tilted_to(told, traced, n) for n in (10.0, MANY))
    assert np.linalg.norm(few[1:]) < 0.2 * np.linalg.norm(many[1:])
    share = (told / told.sum() * np.exp(HARMONICS @ few)).sum()
    np.testing.assert_allclose(share, 1, atol=1e-6)


def test_a_dark_channel_is_left() -> None:
    dark = np.zeros(len(TOWARD))
    np.testing.assert_array_equal(tilted_to(dark, downwards(0.1), MANY), 0)
    np.testing.assert_array_equal(tilted_to(downwards(0.1), dark, 0), 0)


def beam(rng: np.random.Generator, width: float, count: int = 400_000) -> np.ndarray:
    """Directions about -Z, half of them within so many degrees: [N, 3]."""
    theta = np.radians(width) * np.sqrt(-np.log2(1 - rng.random(count)))
    theta, phi = np.minimum(theta, np.pi / 2), 2 * np.pi * rng.random(count)
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), -np.cos(theta)], 1).astype(np.float32)


@pytest.mark.parametrize("width", [1.5, 5, 15])
@pytest.mark.parametrize("wider", [1.0, 1.1])
@pytest.mark.parametrize("axis", [(0, 1, 2), (2, 0, 1)])
def test_a_beam_keeps_its_flux(width: float, wider: float, axis: tuple[int, ...]) -> None:
    """Along the poles, too, where cells are wide; the student adds a thousandth of haze."""
    rng = np.random.default_rng(0)
    traced = beam(rng, width)[:, axis]
    even = rng.normal(size=(4000, 3))
    haze = (even / np.linalg.norm(even, axis=1, keepdims=True)).astype(np.float32)
    rays = np.concatenate([beam(rng, wider * width)[:, axis], haze])
    power = np.concatenate([np.full(400_000, 1.0), np.full(4000, 0.1)])[:, None].repeat(3, 1)
    harmonics = SphericalHarmonics(5)

    def of(direction: np.ndarray) -> np.ndarray:
        return harmonics(torch.from_numpy(direction)).double().numpy()

    told = DirectionalLight()
    told.add(rays, power)
    moments = moments_of(lambda part: of(traced[part]), np.ones((len(traced), 3)))[0]
    there, everywhere = of(told.toward()), of(TOWARD)
    found = tilt(told.power[:, 0], there, moments, 1e5)
    found = bounded(found, told.power[:, 0], there, everywhere)
    gain = np.exp(of(rays) @ found)
    assert (power[:, 0] * gain).sum() / power[:, 0].sum() == pytest.approx(1, abs=0.01)
    assert np.abs(everywhere[:, 1:] @ found[1:]).max() <= 1 + 1e-9
