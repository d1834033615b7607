"""The statistical tests find what is wrong with a sampler, and nothing where nothing is."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import chi2

from purelight_conformance import runner, sampling
from purelight_conformance.lamps import SPHERE
from purelight_conformance.results import SKIPPED
from purelight_conformance.sampling import CLOSURE, COUNT, LEVEL, RADII
from purelight_conformance.suite import Suite
from purelight_format.measures import cap, cap_to_direction, direction_to_cap

Arrays = dict[str, np.ndarray]
Change = Callable[[np.ndarray], np.ndarray]
BROKEN = Path(__file__).with_name("broken_host.py")


def uniform(warp: Change = lambda u: u, shape: Change = np.ones_like) -> sampling.Ask:
    """A sampler of the cap: `warp` moves u [N, 2], `shape` is the density of v [N] on it."""

    def ask(operation: str, inputs: Arrays) -> Arrays:
        view = cap(inputs["point"], SPHERE)
        if operation == "sampler":
            return {"toward": cap_to_direction(warp(inputs["u"]), view)}
        square, _ = direction_to_cap(inputs["toward"], view)
        return {"pdf_solid_angle": shape(square[:, 0]) / view.solid_angle}

    return ask


def put(value: float) -> Change:
    return lambda x: np.full_like(x, value)


def warped(u: np.ndarray) -> np.ndarray:
    """The first coordinate has the density 1.2 - 0.4 v on the square."""
    root = np.sqrt(1.44 - 0.8 * u[:, 0])
    return np.stack(((1.2 - root) / 0.4, u[:, 1]), 1).astype(np.float32)


def tilted(v: np.ndarray) -> np.ndarray:
    return np.asarray(1.2 - 0.4 * v)


@pytest.mark.parametrize("ask", [uniform(), uniform(warped, tilted)])
def test_a_sampler_that_follows_its_density_passes(ask: sampling.Ask) -> None:
    for _, _, test in sampling.TESTS.values():
        assert test(ask, SPHERE) == [""] * len(RADII)


@pytest.mark.parametrize(
    "ask",
    [
        uniform(warped),
        uniform(shape=tilted),
        uniform(lambda u: np.minimum(u, 0.9)),
        uniform(put(np.nan)),
        uniform(shape=put(0)),
        uniform(shape=put(np.nan)),
    ],
)
def test_a_sampler_that_does_not_fails(ask: sampling.Ask) -> None:
    wrong = sampling.wrong_distributions(ask, SPHERE)
    assert all("do not follow" in what for what in wrong)


@pytest.mark.parametrize("value", [1 - 2 * CLOSURE, 1 + 2 * CLOSURE, 0, np.inf, np.nan])
def test_a_density_that_does_not_integrate_to_one_fails(value: float) -> None:
    wrong = sampling.wrong_integrals(uniform(shape=put(value)), SPHERE)
    assert all("integrates to" in what for what in wrong)


def test_an_output_that_is_missing_or_misshapen_is_one_line() -> None:
    for answer in ({}, {"pdf_solid_angle": np.ones((1, 3))}):
        with pytest.raises(sampling.AnswerError, match="pdf_solid_angle of sampler_pdf") as caught:
            sampling.density(lambda operation, inputs, a=answer: a, SPHERE)  # type: ignore[misc]
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("freedom", [1, 15, 255])
def test_the_tail_is_that_of_the_distribution(freedom: int) -> None:
    """Wilson and Hilferty against SciPy, where it decides."""
    cells = freedom + 1
    for wanted in (0.5, 0.1, LEVEL):
        expected = np.full(cells, COUNT / cells)
        excess = np.sqrt(chi2.isf(wanted, freedom) * COUNT / cells / 2)
        observed = expected + np.array([excess, -excess] + [0] * (cells - 2))
        assert sampling.p_value(observed, expected) == pytest.approx(wanted, rel=0.1)


def test_the_level_is_kept() -> None:
    """Of a thousand right samplers, about as many fail as the significance says; few cells too."""
    rng = np.random.default_rng(3)
    weight = rng.exponential(size=256) ** 3
    weight *= COUNT / weight.sum()
    assert (weight < sampling.FEWEST).sum() > 50
    p = [sampling.p_value(rng.multinomial(COUNT, weight / COUNT), weight) for _ in range(1000)]
    for level in (0.5, 0.1, 0.01):
        assert abs(np.mean(np.array(p) < level) - level) < 4 * np.sqrt(level / 1000)


def test_a_host_without_a_sampler_is_shown_as_skipped(whole: Suite) -> None:
    frames = Suite(tuple(v for v in whole.sets if v.group == "frames"), whole.bundles)
    report = runner.run(frames, [sys.executable, str(BROKEN), "refuses"], timeout=20)
    assert report.groups()["statistics"][SKIPPED] == len(sampling.TESTS) * len(RADII)
