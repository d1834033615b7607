"""Torch geometry equals the format's NumPy reference, on hard cases too."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from purelight_format import measures as reference
from purelight_train.networks import geometry

SPHERE = reference.BoundingSphere((0.1, -0.2, 0.3), 0.05)
CENTRE = torch.tensor(SPHERE.center, dtype=torch.float64)


def points() -> np.ndarray:
    """Random points, and: above the pole, below it, just outside, and 1e6 radii away."""
    rng = np.random.default_rng(0)
    offset = rng.normal(size=(200, 3))
    offset[:4] = [[0, 0, 2], [0, 0, -2], [0, 0.0500001, 0], [5e4, 0, 1]]
    return np.asarray(SPHERE.center) + offset


def test_frames() -> None:
    axis = np.random.default_rng(1).normal(size=(500, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    axis[:3] = [[0, 0, -1], [0, 0, 1], [1e-7, 0, -1]]
    for ours, theirs in zip(
        geometry.frame(torch.from_numpy(axis)), reference.frame(axis), strict=True
    ):
        np.testing.assert_allclose(ours.numpy(), theirs, atol=1e-12)


def test_square_and_disk() -> None:
    u = np.random.default_rng(2).random((500, 2))
    u[:3] = [[0.5, 0.5], [0, 0], [1, 0.5]]
    disk = reference.square_to_disk(u)
    np.testing.assert_allclose(geometry.square_to_disk(torch.from_numpy(u)).numpy(), disk)
    back = geometry.disk_to_square(torch.from_numpy(disk)).numpy()
    np.testing.assert_allclose(back, u, atol=1e-12)


@pytest.mark.parametrize("opposite", [False, True])
def test_caps(opposite: bool) -> None:
    point = points()
    u = np.random.default_rng(3).random((len(point), 2))
    cap = reference.cap(point, SPHERE)
    axis, one_minus_cos = geometry.cap(torch.from_numpy(point), CENTRE, SPHERE.radius)
    np.testing.assert_allclose(axis.numpy(), cap.axis, atol=1e-12)
    np.testing.assert_allclose(one_minus_cos.numpy(), cap.one_minus_cos, rtol=1e-9)
    toward = reference.cap_to_direction(u, cap)
    ours = geometry.cap_to_direction(torch.from_numpy(u), axis, one_minus_cos)
    np.testing.assert_allclose(ours.numpy(), toward, atol=1e-12)
    aimed = -toward if opposite else toward
    square, inside = geometry.direction_to_cap(torch.from_numpy(aimed), axis, one_minus_cos)
    assert (inside.numpy() == reference.direction_to_cap(aimed, cap)[1]).all()
    assert bool(inside.any()) is not opposite
    if not opposite:
        np.testing.assert_allclose(square.numpy(), u, atol=1e-4)


def test_centre_has_an_axis() -> None:
    axis, one_minus_cos = geometry.cap(CENTRE[None], CENTRE, SPHERE.radius)
    assert axis.tolist() == [[0, 0, 1]]
    assert float(one_minus_cos) == 1
