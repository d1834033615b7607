"""Statistical tests of a sampler: they need no vectors, only the density that the host states."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from purelight_conformance.candidates import directions
from purelight_conformance.suite import VectorSet
from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere, Cap, cap, cap_to_direction, direction_to_cap

LAMP = "wild"
RADII = np.array([1.2, 2.0, 5.0, 15.0])  # Distances of the points from the centre.
COUNT = 1 << 14  # Directions from each point.
BINS, SIDE = 16, 32  # Along a side of the cap's square, for counting and for quadrature.
FEWEST = 5  # Counts that a cell of the test expects.
LEVEL = 0.01 / len(RADII)  # Significance, corrected for the number of tests (Bonferroni).
CLOSURE = 1e-3

Arrays = dict[str, np.ndarray]
Ask = Callable[[str, Arrays], Arrays]  # Operation and inputs -> outputs of the host.
Test = Callable[[Ask, BoundingSphere], list[str]]  # What is wrong at each point, empty if nothing.


class AnswerError(PureLightError):
    """What a host gives is not what was asked for."""


def points(sphere: BoundingSphere) -> np.ndarray:
    """[P, 3] outside the sphere, as a host gets them."""
    offset = RADII[:, None] * directions(len(RADII), np.random.default_rng(12))
    return (sphere.center + sphere.radius * offset).astype(np.float32)


def wrong_integrals(ask: Ask, sphere: BoundingSphere) -> list[str]:
    """Where the density does not integrate to one over the cap."""
    found = density(ask, sphere).mean(1)
    return [
        "" if abs(value - 1) <= CLOSURE else f"the density integrates to {value:.5g}"
        for value in found
    ]


def wrong_distributions(ask: Ask, sphere: BoundingSphere) -> list[str]:
    """Where directions do not follow the density: chi-square over the cells of the square."""
    blocks = (-1, BINS, SIDE // BINS, BINS, SIDE // BINS)
    expected = density(ask, sphere).reshape(blocks).sum((2, 4)).reshape(-1, BINS * BINS)
    found = []
    for observed, weight in zip(counts(ask, sphere), expected, strict=True):
        with np.errstate(all="ignore"):
            p = p_value(observed, weight / weight.sum() * COUNT)
        found.append("" if p >= LEVEL else f"directions do not follow the density (p = {p:.2g})")
    return found


def density(ask: Ask, sphere: BoundingSphere) -> np.ndarray:
    """The host's density on the square of each point, at the middles of cells: [P, SIDE²]."""
    side = (np.arange(SIDE) + 0.5) / SIDE
    u = np.stack(np.meshgrid(side, side, indexing="ij"), -1).reshape(-1, 2)
    point, view = _seen(sphere, len(u))
    toward = cap_to_direction(np.tile(u, (len(RADII), 1)), view).astype(np.float32)
    pdf = _output(ask, "sampler_pdf", {"point": point, "toward": toward}, "pdf_solid_angle", ())
    return (pdf * view.solid_angle).reshape(len(RADII), -1)


def counts(ask: Ask, sphere: BoundingSphere) -> np.ndarray:
    """How many directions fall into each cell of the square: [P, BINS²]."""
    point, view = _seen(sphere, COUNT)
    u = np.random.default_rng(13).random((len(point), 2), np.float32)
    toward = _output(ask, "sampler", {"point": point, "u": u}, "toward", (3,))
    with np.errstate(all="ignore"):
        square, _ = direction_to_cap(toward, view)
    cell = np.clip(np.nan_to_num(square) * BINS, 0, BINS - 1).astype(int)
    index = (cell[:, 0] * BINS + cell[:, 1]).reshape(len(RADII), COUNT)
    return np.stack([np.bincount(row, minlength=BINS * BINS) for row in index])


def p_value(observed: np.ndarray, expected: np.ndarray) -> float:
    """How likely counts are to differ from expectation by this much or more (chi-square test).

    Cells that expect few counts are put together. The distribution's tail is the approximation
    of Wilson and Hilferty, "The distribution of chi-square", PNAS 17 (1931): the cube root of
    X²/k is normal, with mean 1 - 2/(9k) and variance 2/(9k).

    Arguments:
        observed, expected: [K] with the same sum.
    """
    few = expected < FEWEST
    seen, wanted = (np.append(n[~few], n[few].sum()) for n in (observed, expected))
    used = (seen != 0) | (wanted != 0)
    freedom = max(1, int(used.sum()) - 1)
    statistic = ((seen - wanted)[used] ** 2 / wanted[used]).sum()
    variance = 2 / (9 * freedom)
    deviation = (np.cbrt(statistic / freedom) - 1 + variance) / math.sqrt(variance)
    return 0.5 * math.erfc(deviation / math.sqrt(2))


TESTS: dict[str, tuple[str, str, Test]] = {  # Operation and flag of each.
    "integral": ("sampler_pdf", "UNNORMALISED", wrong_integrals),
    "distribution": ("sampler", "DISTRIBUTION", wrong_distributions),
}


def vectors(test: str, sphere: BoundingSphere) -> VectorSet:
    """A test as a set whose vectors are the points; nothing in it is compared."""
    operation, flag, _ = TESTS[test]
    return VectorSet(
        f"statistics/{test}", "statistics", operation, LAMP, {"point": points(sphere)}, {}, {},
        {flag: list(range(len(RADII)))},
    )  # fmt: skip


def _seen(sphere: BoundingSphere, count: int) -> tuple[np.ndarray, Cap]:
    """Each point `count` times, and its cap in float64."""
    point = points(sphere).repeat(count, 0)
    return point, cap(point.astype(np.float64), sphere)


def _output(
    ask: Ask, operation: str, inputs: Arrays, name: str, shape: tuple[int, ...]
) -> np.ndarray:
    """One output in float64.

    Raises:
        AnswerError: If the host does not give it, or not in its shape.
    """
    value = ask(operation, inputs).get(name)
    wanted = (len(inputs["point"]), *shape)
    if value is None or value.shape != wanted:
        raise AnswerError(f"{name} of {operation} does not have the shape {wanted}")
    return value.astype(np.float64)
