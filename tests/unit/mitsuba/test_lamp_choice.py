"""Which lamp a vertex aims at: probabilities that are what they say, and less noise by them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from purelight_format.members import PHOTOMETRY
from purelight_mitsuba.lamps import lamp_choice
from purelight_mitsuba.lamps.lamp_choice import SIDE, cell, intensities
from purelight_mitsuba.lamps.table import Lamps
from tests.support import analytic_lamps as lamps
from tests.support.agreement import SIGNIFICANCE, agree, passes

T = mi.ScalarTransform4f
DRAWS = 1 << 17
POINTS = {
    "between": (0.7, 0.1, 0.2),
    "inside": (0.35, -0.2, 0.2),
    "at the centre": lamps.CENTRE,
    "on the sphere": (0.3 + lamps.RADIUS, -0.2, 0.1),
    "far": (1e6, -2e6, 1e6),
}


@pytest.fixture(scope="module")
def bundles(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A ball without photometry, and one whose photometry is that of a spot toward -Z."""
    folder, ball = tmp_path_factory.mktemp("lamps"), lamps.ball()
    spot = ball.write(folder / "spot.plux", {PHOTOMETRY: lamps.photometry(ball, 30.0)})
    return {"ball": ball.write(folder / "ball.plux"), "spot": spot}


def lamp(path: Path, to_world: Any, dimmer: float = 1.0) -> dict[str, Any]:
    return {"type": "purelight", "filename": str(path), "to_world": to_world, "dimmer": dimmer}


@pytest.fixture(scope="module")
def various(bundles: dict[str, Path]) -> mi.Scene:
    """Near and far, large and small, dark and bright, even and turned lamps."""
    ball, spot, rng = bundles["ball"], bundles["spot"], np.random.default_rng(3)
    content = {
        "dark": lamp(ball, T().translate([0.5, 0, 0]), 0.0),
        "weak": lamp(ball, T(), 0.01),
        "large": lamp(ball, T().translate([8, 2, 1]).scale(5)),
        "small": lamp(ball, T().translate([0.9, 0.5, 0.5]).scale(1e-3), 30.0),
    }
    for index in range(8):
        turned = T().translate(list(rng.uniform(-3, 3, 3))).rotate([0.6, 0, 0.8], 40 * index)
        content[f"spot{index}"] = lamp(spot, turned, float(rng.uniform(0.2, 5)))
    last = {"z": lamp(ball, T().translate([-2, 0, 0]), 0.0)}
    return mi.load_dict({"type": "scene", **content, **last})


def probabilities(table: Lamps, count: int, p: Any) -> np.ndarray:
    lane = dr.arange(mi.UInt32, count)
    return table.probability(lane, mi.Point3f(p), mi.Bool(True)).numpy().astype(np.float64)


@pytest.mark.parametrize("place", POINTS)
def test_frequencies_are_the_probabilities(various: mi.Scene, place: str) -> None:
    emitters = various.emitters()
    table, point = Lamps(emitters, various), mi.Point3f(POINTS[place])
    expected = probabilities(table, len(emitters), POINTS[place])
    np.testing.assert_allclose(expected.sum(), 1, rtol=1e-5)
    u = mi.Float(np.random.default_rng(1).uniform(size=DRAWS).astype(np.float32))
    drawn, chance = table.pick(dr.minimum(u, dr.one_minus_epsilon(mi.Float)), point, mi.Bool(True))
    lane, counts = drawn.numpy(), np.bincount(drawn.numpy(), minlength=len(emitters))
    np.testing.assert_allclose(chance.numpy(), expected[lane], rtol=1e-4)
    often = expected * DRAWS > 5  # Rarer lamps count as one.
    cells = [np.append(x[often], x[~often].sum()) for x in (counts, expected * DRAWS)]
    seen, wanted = (x[cells[1] > 0] for x in cells)
    assert stats.chisquare(seen, wanted * seen.sum() / wanted.sum()).pvalue > SIGNIFICANCE
    for emitter, own, count in zip(emitters, expected, counts, strict=True):
        assert (own > 0) == (emitter.level > 0)
        assert count == 0 or emitter.level > 0


@pytest.mark.parametrize("u", [0.0, 1 - 2**-24])
def test_the_ends_of_the_interval_draw_lamps_that_shine(various: mi.Scene, u: float) -> None:
    emitters = various.emitters()
    table, points = Lamps(emitters, various), np.array(list(POINTS.values())).T
    drawn, chance = table.pick(mi.Float(u), mi.Point3f(points), mi.Bool(True))
    assert all(emitters[index].level > 0 for index in drawn.numpy())
    assert (chance.numpy() > 0).all()


def test_a_spot_turned_away_is_chosen_less(bundles: dict[str, Path]) -> None:
    turned = T().translate([1, 0, 0]).rotate([1, 0, 0], 180)
    content = {"down": lamp(bundles["spot"], T()), "up": lamp(bundles["spot"], turned)}
    scene = mi.load_dict({"type": "scene", **content})
    below = probabilities(Lamps(scene.emitters(), scene), 2, (0.8, 0, -2))
    above = probabilities(Lamps(scene.emitters(), scene), 2, (0.8, 0, 2))
    assert below[0] > 0.8
    assert above[1] > 0.8


def test_maps_hold_mean_intensities(bundles: dict[str, Path]) -> None:
    turned = T().rotate([1, 0, 0], 90)  # -Z to +Y.
    scene = mi.load_dict({"type": "scene", "spot": lamp(bundles["spot"], turned)})
    table = intensities(scene.emitters()[0])
    direction = np.random.default_rng(2).normal(size=(3, 200_000)).astype(np.float32)
    index = cell(mi.Vector3f(direction)).numpy()
    assert np.unique(index).size == SIDE**2
    np.testing.assert_allclose(table[index].mean(), 1, rtol=0.03)
    cosine = direction[1] / np.linalg.norm(direction, axis=0)
    true = 2 * 31 * np.maximum(cosine, 0) ** 30
    np.testing.assert_allclose(
        table[index].mean(where=cosine > 0.95), true.mean(where=cosine > 0.95), rtol=0.1
    )
    assert table[index].max(where=cosine < 0, initial=0) < 1e-3


def test_one_lamp_is_chosen_without_a_table(bundles: dict[str, Path]) -> None:
    scene = mi.load_dict({"type": "scene", "only": lamp(bundles["ball"], T())})
    table = Lamps(scene.emitters(), scene)
    lane, chance = table.pick(mi.Float(0.5), mi.Point3f(0), mi.Bool(True))
    assert (int(lane[0]), float(chance[0])) == (0, 1.0)
    assert table._choice is None


def floor(near: dict[str, Any], far: dict[str, Any]) -> mi.Scene:
    """A floor and a wall under a near lamp, with another one far away."""
    return mi.load_dict(lamps.room(size=16) | {"near": near, "far": far})


@pytest.mark.parametrize("engine", ["fused", "queued"])
@pytest.mark.parametrize("mode", ["accurate", "fast"])
def test_two_lamps_give_the_sum_of_each(bundles: dict[str, Path], engine: str, mode: str) -> None:
    near = lamp(bundles["spot"], T().translate([-0.2, 0.1, 0.3]).rotate([0, 1, 0], 100))
    far = lamp(bundles["ball"], T().translate([1.5, -1, 1.5]).scale(0.5), 4.0)
    settings = {"type": "purelight", "engine": engine, "mode": mode, "max_depth": 3}
    dark = {"dimmer": 0.0}
    both = passes(floor(near, far), settings, 64, 16)
    first, second = (
        passes(floor(*pair), settings, 64, 16, first=first)
        for first, pair in ((100, (near, far | dark)), (200, (near | dark, far)))
    )
    agree(both, first + second)


def test_a_near_weak_lamp_is_less_noisy_than_by_power(
    bundles: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    near = lamp(bundles["ball"], T().scale(0.1))
    far = lamp(bundles["ball"], T().translate([40, 0, 20]))
    settings = {"type": "purelight", "max_depth": 2, "engine": "fused"}
    ours = passes(floor(near, far), settings, spp=64, count=32)
    monkeypatch.setattr(lamp_choice, "DEFENSIVE", 1.0)
    by_power = passes(floor(near, far), settings, spp=64, count=32)
    np.testing.assert_allclose(ours.mean(), by_power.mean(), rtol=0.05)
    lit = by_power.mean(0) > 0
    assert 20 * np.median(ours.var(0)[lit]) < np.median(by_power.var(0)[lit])


def test_equal_seeds_give_equal_pictures(various: mi.Scene) -> None:
    emitters = {f"l{k}": e for k, e in enumerate(various.emitters())}
    scene = mi.load_dict(lamps.room(size=16) | emitters)
    integrator = mi.load_dict({"type": "purelight", "engine": "fused"})
    first, again = (np.array(mi.render(scene, integrator=integrator, spp=4, seed=7)) for _ in "ab")
    np.testing.assert_array_equal(first, again)
