"""Drawing from a radiance map: right in the mean, and the likelier the brighter."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.radiance_map import DEFENCE, SIDE, RadianceMap, View, draw, lattice


def drawn(cells: np.ndarray, count: int = 1 << 18) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights, cells being chosen by their second channel."""
    tables = [mi.Float(channel) for channel in cells.T.astype(np.float32)]
    looks = [lambda cell, table=table: dr.gather(mi.Float, table, cell) for table in tables]
    u = np.random.default_rng(0).random((2, count)).astype(np.float32)
    point, weight = draw(View(looks, 1), mi.Point2f(u))
    return np.array(point).T, np.broadcast_to(np.array(weight).T, (count, 3))


def cell_of(point: np.ndarray) -> np.ndarray:
    return (point * SIDE).astype(int) @ [1, SIDE]


def test_weights_average_to_the_radiance_of_each_cell() -> None:
    cells = np.random.default_rng(1).exponential(size=(SIDE * SIDE, 3))
    cells[6] = 0
    cells[7, 1] = 0  # Of another hue than the rest
    point, weight = drawn(cells)
    cell = cell_of(point)
    assert not weight[cell == 6].any()
    for index, radiance in enumerate(cells):
        mean = np.where((cell == index)[:, None], weight, 0).mean(0) * len(cells)
        count = max((cell == index).sum(), 1)
        np.testing.assert_allclose(mean, radiance, rtol=5 / np.sqrt(count))
    inner = np.modf(point * SIDE)[0]
    np.testing.assert_allclose(inner.mean(0), 0.5, atol=0.01)


def test_candidates_are_drawn_by_their_leading_channel() -> None:
    cells = np.random.default_rng(1).exponential(size=(SIDE * SIDE, 3))
    point, _ = drawn(cells)
    together = np.array(mi.ArrayXu(lattice(mi.UInt32(np.arange(SIDE)))))
    share = np.zeros(SIDE * SIDE)
    importance = cells[:, 1][together]
    importance = importance + DEFENCE * importance.mean(0)
    share[together] = importance / importance.sum(0) / SIDE
    assert (np.sort(together, None) == np.arange(SIDE * SIDE)).all()
    counts = np.bincount(cell_of(point), minlength=SIDE * SIDE)
    expected = share * len(point)
    assert (np.abs(counts - expected) < 5 * np.sqrt(expected)).all()


@pytest.mark.parametrize("cell", [0, 255, 100])
def test_a_single_lit_cell_is_mostly_drawn_among_its_candidates(cell: int) -> None:
    cells = np.zeros((SIDE * SIDE, 3))
    cells[cell] = 1, 2, 3
    point, weight = drawn(cells, 10_000)
    lit = weight[:, 0] > 0
    chance = (1 + DEFENCE / SIDE) / (1 + DEFENCE)
    assert lit.mean() == pytest.approx(chance / SIDE, abs=0.02)
    assert (cell_of(point[lit]) == cell).all()
    expected = np.array([[1, 2, 3]]) / SIDE / chance + 0 * weight[lit]
    np.testing.assert_allclose(weight[lit], expected, rtol=1e-5)


def test_a_dark_map_gives_nothing() -> None:
    point, weight = drawn(np.zeros((SIDE * SIDE, 3)), 100)
    assert (weight == 0).all()
    assert np.isfinite(point).all()


def test_cells_are_those_of_the_whole_map() -> None:
    from analytic_lamps import fast_map  # Needs Mitsuba's variant.

    from purelight_mitsuba.fused import FusedNetwork

    network = FusedNetwork(fast_map((3.0, 2.0, 1.0)))
    view = RadianceMap(network, (1, 0, 0))(mi.Point3f(1, 2, 3))
    cells = mi.UInt32([0, 17, 255])
    np.testing.assert_allclose(np.array(view.colour(cells)), [[3] * 3, [2] * 3, [1] * 3])
    np.testing.assert_allclose(np.array(view.importance(cells)), [3] * 3)
