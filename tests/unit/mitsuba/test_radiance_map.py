"""Drawing from a radiance map: right in the mean, and proportional to luminance."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

from purelight_mitsuba.radiance_map import RadianceMap

SIZE = 4


def draw(cells: np.ndarray, count: int = 1 << 16) -> tuple[np.ndarray, np.ndarray]:
    table = np.empty(cells.shape, object)
    for index in np.ndindex(cells.shape):
        table[index] = mi.Float(float(cells[index]))
    u = np.random.default_rng(0).random((2, count)).astype(np.float32)
    point, weight = RadianceMap(table).sample(mi.Point2f(u))
    return np.array(point).T, np.broadcast_to(np.array(weight).T, (count, 3))


def test_weights_average_to_the_mean_radiance_and_cells_follow_luminance() -> None:
    cells = np.random.default_rng(1).exponential(size=(SIZE, SIZE, 3))
    cells[1, 2] = 0
    point, weight = draw(cells)
    np.testing.assert_allclose(weight.mean(0), cells.mean((0, 1)), rtol=0.02)
    column, line = (point * SIZE).astype(int).T
    counts = np.zeros((SIZE, SIZE))
    np.add.at(counts, (line, column), 1)
    luminance = cells @ [0.212671, 0.715160, 0.072169]
    expected = luminance / luminance.sum() * len(point)
    assert counts[1, 2] == 0
    lit = expected > 0
    assert (np.abs(counts - expected)[lit] < 5 * np.sqrt(expected[lit])).all()
    inner = np.modf(point * SIZE)[0]
    np.testing.assert_allclose(inner.mean(0), 0.5, atol=0.01)


@pytest.mark.parametrize("cell", [(0, 0), (3, 3), (2, 1)])
def test_a_single_lit_cell_is_always_drawn(cell: tuple[int, int]) -> None:
    cells = np.zeros((SIZE, SIZE, 3))
    cells[cell] = 1, 2, 3
    point, weight = draw(cells, 1000)
    assert (np.floor(point * SIZE).astype(int) == cell[::-1]).all()
    np.testing.assert_allclose(weight, np.array([[1, 2, 3]]) / SIZE**2 + 0 * weight, rtol=1e-5)


def test_a_dark_map_gives_nothing() -> None:
    point, weight = draw(np.zeros((SIZE, SIZE, 3)), 100)
    assert (weight == 0).all()
    assert np.isfinite(point).all()
