"""A density learned from points: it sums to one, is drawn as it says, and finds what is narrow."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chisquare

from purelight_train.learning.density_tree import DensityTree

COUNT = 1 << 15


def spot(dimension: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Half of the points even, half in a small box off the middle; weights up to two."""
    rng = np.random.default_rng(dimension)
    points = rng.random((COUNT, dimension))
    points[: COUNT // 2] = 0.3 + size * points[: COUNT // 2]
    return points, 1 + rng.random(COUNT)


@pytest.mark.parametrize("dimension", [1, 2, 4])
def test_density_sums_to_one(dimension: int) -> None:
    tree = DensityTree.of(*spot(dimension, 0.01))
    volume = np.prod(tree.high - tree.low, axis=1)
    leaf = tree.axis < 0
    assert volume[leaf].sum() == pytest.approx(1)
    assert (tree.density * volume)[leaf].sum() == pytest.approx(1)


def test_points_are_in_their_leaves() -> None:
    points, weight = spot(3, 0.05)
    tree = DensityTree.of(points, weight)
    leaf = tree.leaves(points)
    assert (tree.axis[leaf] < 0).all()
    assert ((points >= tree.low[leaf]) & (points < tree.high[leaf])).all()


def test_points_are_drawn_by_the_density() -> None:
    tree = DensityTree.of(*spot(2, 0.1))
    drawn = tree.sample(COUNT, np.random.default_rng(1))
    count = np.bincount(tree.leaves(drawn), minlength=len(tree.axis))
    expected = tree.density * np.prod(tree.high - tree.low, axis=1) * COUNT
    leaf = (tree.axis < 0) & (expected > 0)
    assert count[~leaf].sum() == 0
    # Leaves take turns, so that counts vary less than independent ones would
    assert chisquare(count[leaf], expected[leaf]).pvalue > 1e-3
    inside = (drawn[:, 0] * 7 % 1 < 0.5).mean()  # Even within leaves, whose edges are elsewhere.
    points, weight = spot(2, 0.1)
    assert inside == pytest.approx(np.average(points[:, 0] * 7 % 1 < 0.5, weights=weight), abs=0.02)


def test_a_narrow_beam_is_found() -> None:
    size = 1e-3
    tree = DensityTree.of(*spot(4, size))
    middle = np.full((1, 4), 0.3 + size / 2)
    assert tree.density[tree.leaves(middle)][0] > 0.01 / size**4


@pytest.mark.parametrize("place", [0.0, 0.25, np.nextafter(1, 0)])
def test_one_place_ends(place: float) -> None:
    """Points that no box divides, at the edge of the cube too."""
    tree = DensityTree.of(np.full((100, 2), place), np.ones(100))
    assert np.isfinite(tree.density).all()
    assert (tree.sample(10, np.random.default_rng(0)) >= 0).all()
