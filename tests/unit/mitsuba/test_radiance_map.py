"""Drawing from a radiance map: in proportion to luminance, and right in the mean."""

from __future__ import annotations

from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from purelight_format import measures
from purelight_format.color import LUMINANCE
from purelight_mitsuba import conformance_host
from purelight_mitsuba.lamps.luminaire import load
from purelight_mitsuba.sampling.radiance_map import SIDE, Drawn, draw, lit
from purelight_mitsuba.translate.operators import row
from purelight_mitsuba.transport import batched_maps
from purelight_onnx.luminaire import Luminaire
from tests.support.analytic_lamps import CENTRE, RADIUS, SPHERE, ball, shining_map

CELLS = SIDE * SIDE
COUNT = 1 << 18
SIGNIFICANCE = 0.01


def uniform(count: int = COUNT) -> np.ndarray:
    return np.random.default_rng(0).random((2, count)).astype(np.float32)


def drawn(cells: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """Points [N, 2] and weights [N, 3] from a map [CELLS, 3], and how many lanes were spoilt."""
    values = mi.Float(cells.astype(np.float32).ravel())
    looked_up = [dr.gather(mi.Float, values, mi.UInt32(k)) for k in range(CELLS * 3)]
    found = draw(row(looked_up).reshape(SIDE, SIDE, 3), mi.Point2f(u))
    found.spoilt = found.spoilt + dr.zeros(mi.UInt32, u.shape[1])  # A number for every lane.
    dr.eval(found)  # At once: one kernel.
    return np.array(found.square).T, np.array(found.weight).T, int(dr.sum(found.spoilt)[0])


def cell_of(point: np.ndarray) -> np.ndarray:
    return (point * SIDE).astype(int) @ [1, SIDE]


def blobs(lit_cells: int) -> np.ndarray:
    """A map of unequal hues and powers in some scattered cells, dark elsewhere."""
    rng = np.random.default_rng(lit_cells)
    cells = np.zeros((CELLS, 3))
    places = rng.choice(CELLS, lit_cells, replace=False)
    cells[places] = rng.exponential(size=(lit_cells, 1)) * rng.dirichlet([0.5] * 3, lit_cells)
    return cells


@pytest.mark.parametrize("lit_cells", [1, 4, 16, 256])
def test_cells_are_drawn_in_proportion_to_their_luminance(lit_cells: int) -> None:
    cells = blobs(lit_cells)
    point, *_ = drawn(cells, uniform())
    share = cells @ LUMINANCE / (cells @ LUMINANCE).sum()
    counts = np.bincount(cell_of(point), minlength=CELLS)
    assert not counts[share == 0].any()
    common = share * COUNT > 5  # What is rarer is counted together.
    expected = np.append(share[common], share[~common].sum()) * COUNT
    found = np.append(counts[common], counts[~common].sum())
    filled = expected > 0  # One cell alone has no distribution to test: all points are in it.
    p = stats.chisquare(found[filled], expected[filled]).pvalue
    assert p > SIGNIFICANCE or lit_cells == 1


@pytest.mark.parametrize("lit_cells", [1, 4, 16, 256])
def test_a_draw_adds_no_noise(lit_cells: int) -> None:
    """Every weight has the luminance of the whole map, and the hue of its cell."""
    cells = blobs(lit_cells)
    point, weight, _ = drawn(cells, uniform())
    np.testing.assert_allclose(weight @ LUMINANCE, (cells @ LUMINANCE).mean(), rtol=1e-5)
    cell = cells[cell_of(point)]
    hue = cell / (cell @ LUMINANCE)[:, None]
    np.testing.assert_allclose(weight, hue * (cells @ LUMINANCE).mean(), rtol=1e-4, atol=1e-7)


@pytest.mark.parametrize("lit_cells", [1, 4, 16, 256])
def test_weights_average_to_the_map(lit_cells: int) -> None:
    cells = blobs(lit_cells)
    _, weight, _ = drawn(cells, uniform())
    error = weight.std(0) / np.sqrt(COUNT) + 1e-5 * cells.mean(0)
    assert (np.abs(weight.mean(0) - cells.mean(0)) < 4 * error).all()


def test_points_are_even_in_their_cells() -> None:
    point, *_ = drawn(blobs(16), uniform())
    inner = np.modf(point * SIDE)[0]
    for axis in inner.T:
        assert stats.kstest(axis, "uniform").pvalue > SIGNIFICANCE / 2
    assert abs(np.corrcoef(inner.T)[0, 1]) < 4 / np.sqrt(COUNT)


@pytest.mark.parametrize("cell", [0, 15, 100, 240, 255])
@pytest.mark.parametrize("power", [1e-12, 1.0, 1e12])
def test_the_only_lit_cell_is_always_drawn(cell: int, power: float) -> None:
    cells = np.zeros((CELLS, 3))
    cells[cell] = 1 * power, 2 * power, 3 * power
    edges = np.float32([0, 0.5, 1 - 2**-24])
    point, weight, _ = drawn(cells, np.array(np.meshgrid(edges, edges)).reshape(2, -1))
    assert (cell_of(point) == cell).all()
    np.testing.assert_allclose(weight, cells[[cell] * len(weight)] / CELLS, rtol=1e-5)


def test_the_largest_numbers_stay_in_lit_cells() -> None:
    """Rounding of running totals never leads into the dark."""
    edges = np.float32([0, 2**-24, 1 - 2**-23, 1 - 2**-24])
    u = np.array(np.meshgrid(edges, edges)).reshape(2, -1)
    for seed in range(16):
        cells = blobs(40 + seed)
        point, weight, _ = drawn(cells, u)
        assert (cells[cell_of(point)] @ LUMINANCE > 0).all()
        assert np.isfinite(weight).all()


def test_a_dark_map_gives_nothing() -> None:
    point, weight, spoilt = drawn(np.zeros((CELLS, 3)), uniform(100))
    assert (weight == 0).all()
    assert np.isfinite(point).all()
    assert spoilt == 0


@pytest.mark.parametrize("bad", [-1.0, np.nan, np.inf, -np.inf])
def test_what_is_no_radiance_counts_as_dark(bad: float) -> None:
    cells = blobs(256)
    cells[::3] = bad
    cells[1::3, 0] = bad
    point, weight, spoilt = drawn(cells, uniform(1000))
    assert (cell_of(point) % 3 != 0).all()
    assert ((weight >= 0) & np.isfinite(weight)).all()
    assert spoilt == (0 if bad == -1 else 1000)


def test_channels_without_flux_are_black() -> None:
    cells = row([mi.Float(1) for _ in range(CELLS * 3)]).reshape(SIDE, SIDE, 3)
    weight = draw(lit(cells, np.array([0.0, 2.0, 0.0])), mi.Point2f(0.3, 0.7)).weight
    np.testing.assert_allclose(np.array(weight).ravel(), [0, 1, 0], rtol=1e-5)


# Maps of networks


@pytest.fixture(scope="module")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    lamp = ball()
    lamp.networks["fast_map"] = shining_map()
    return lamp.write(tmp_path_factory.mktemp("maps") / "shining.plux")


def points(count: int) -> np.ndarray:
    away = np.random.default_rng(2).normal(size=(count, 3))
    away *= RADIUS * 2.5 / np.linalg.norm(away, axis=1, keepdims=True)
    return (np.array(CENTRE) + away).astype(np.float32)


def test_maps_of_onnx_runtime_are_drawn_from_alike(
    bundle: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In several batches, and only where a lane is active."""
    monkeypatch.setattr(batched_maps, "ROWS", 400)
    luminaire, count = load(bundle), 1000
    point, u = mi.Point3f(np.ascontiguousarray(points(count).T)), mi.Point2f(uniform(count))
    (cells,) = luminaire.network("fast_map")(point)
    compiled = draw(lit(cells, luminaire.flux), u)
    active = np.random.default_rng(3).random(count) < 0.9
    batched = batched_maps.draw_batched(luminaire, point, u, mi.Bool(active))
    for name in Drawn.__dataclass_fields__:
        ours, theirs = (np.array(getattr(x, name)) for x in (batched, compiled))
        np.testing.assert_allclose(ours[..., active], theirs[..., active], rtol=1e-3, atol=1e-4)
        assert not ours[..., ~active].any()


def test_light_is_the_integral_of_the_map(bundle: Path) -> None:
    """Irradiance by the runtime against a fine grid over every cell."""
    host = conformance_host.MitsubaHost()
    host.open(str(bundle))
    count = 1 << 16
    for point in points(2):
        normal = (np.array(CENTRE) - point) / (2.5 * RADIUS) + [0.0, 0.3, 0.4]
        normal /= np.linalg.norm(normal)
        inputs = {
            "point": np.tile(point, (count, 1)), "normal": np.tile(normal, (count, 1)),
            "u": uniform(count).T,
        }  # fmt: skip
        inputs = {name: array.astype(np.float32) for name, array in inputs.items()}
        found = host.evaluate("map_estimate", {}, inputs)["irradiance"]
        expected = integral(bundle, point.astype(np.float64), normal)
        error = found.std(0) / np.sqrt(count) + 1e-4 * expected
        assert (np.abs(found.mean(0) - expected) < 4 * error).all()


def integral(bundle: Path, point: np.ndarray, normal: np.ndarray, fine: int = 16) -> np.ndarray:
    """Irradiance of the bundle's map at a point: [3]."""
    maps = Luminaire.open(bundle).radiance_map(point[None].astype(np.float32))[0]
    grid = (np.stack(np.meshgrid(*2 * [np.arange(SIDE * fine)]), -1) + 0.5) / (SIDE * fine)
    view = measures.cap(np.tile(point, (grid[..., 0].size, 1)), SPHERE)
    toward = measures.cap_to_direction(grid.reshape(-1, 2), view)
    cosine = np.maximum(toward @ normal, 0).reshape(SIDE * fine, SIDE * fine, 1)
    radiance = maps.repeat(fine, 0).repeat(fine, 1)
    return (radiance * cosine).mean((0, 1)) * 2 * np.pi * view.one_minus_cos[0]
