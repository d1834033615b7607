"""Planes that files leave out."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_format.photometry.symmetry import symmetry, whole_circle
from purelight_format.photometry.table import IntensityTable
from tests.support.distributions import FULL, VERTICAL, skewed

PARTS = [  # Kind, and the planes of which the whole circle follows
    (1, [0.0]), (1, [0.0, 360.0]), (4, [0, 15, 45, 90]), (4, [270, 300, 360]), (2, [0, 60, 180]),
    (2, [180, 270, 360]), (3, [90, 180, 270]), (3, [-90, 0, 30, 90]),
    (3, [270, 300, 360, 405, 450]),
    (0, [0, 90, 180, 270]), (0, [5, 95, 185, 275]),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "planes"), PARTS)
def test_left_out_planes_come_back(kind: int, planes: list[float]) -> None:
    part = skewed(np.array(planes, float), kind)
    angle, rows = whole_circle(part.horizontal, part.candela)
    assert angle[0] == 0
    assert angle[-1] == 360
    assert (np.diff(angle) > 0).all()
    inside = np.isin(np.round(angle, 6), np.round(np.array(planes) % 360, 6))
    wanted = skewed(angle, kind).candela
    np.testing.assert_allclose(rows[inside], wanted[inside], atol=1e-9)
    if kind:  # Images are planes with the values of the formula.
        np.testing.assert_allclose(rows, wanted, atol=1e-2)


@pytest.mark.parametrize("kind", range(5))
def test_symmetry_is_told(kind: int) -> None:
    table = skewed(FULL, kind)
    assert symmetry(table.horizontal, table.candela) == kind


def test_a_gap_is_bridged() -> None:
    angle, rows = whole_circle(np.array([0.0, 30.0, 120.0]), np.array([[0.0], [1.0], [8.0]]))
    np.testing.assert_array_equal(angle, [0, 30, 120, 360])
    np.testing.assert_array_equal(rows.ravel(), [0, 1, 8, 0])


def test_interpolation_agrees_with_resampling() -> None:
    table = skewed()
    at = np.array([[3.0, 17.0], [91.2, 359.0], [177.0, 181.0]])
    value = table.at(at[:, 0], at[:, 1])
    for (v, h), found in zip(at, value, strict=True):
        assert table.resampled(np.array([v]), np.array([h]))[0, 0] == pytest.approx(found)


def test_flux_of_a_uniform_sphere_and_hemisphere() -> None:
    even = IntensityTable(VERTICAL, np.zeros(1), np.ones((1, 37)))
    assert even.flux == pytest.approx(4 * np.pi)
    below = IntensityTable(np.linspace(0, 90, 19), np.array([0.0, 90.0]), np.ones((2, 19)))
    assert below.flux == pytest.approx(2 * np.pi, rel=1e-3)
    assert below.at(np.array([100.0]), np.array([0.0]))[0] == 0


def test_unequal_planes_count_by_their_share() -> None:
    rows = np.array([[1.0], [1.0], [3.0], [1.0]]).repeat(37, 1)
    table = IntensityTable(VERTICAL, np.array([0.0, 10.0, 20.0, 360.0]), rows)
    assert table.flux / (4 * np.pi) == pytest.approx((10 + 20 + 340 * 2) / 360)
