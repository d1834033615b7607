"""Networks drawn at random from the whole profile, as compiled C++, against the reference."""

from __future__ import annotations

from pathlib import Path
from random import Random
from unittest import mock

import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_format.networks import reference
from purelight_format.networks.profile import inspect
from purelight_format.networks.vectors import SIGNATURES
from tests.fuzz.graphs import Graph
from tests.fuzz.networks import UNSETTLED, with_all_values
from tests.support.compiled import Batch, Network

ROWS = 6


def drawn(rng: Random, count: int) -> dict[str, Network]:
    """Networks that the profile accepts."""
    made: dict[str, Network] = {}
    while len(made) < count:
        network = rng.choice(list(SIGNATURES))
        model = Graph(rng, network).model()
        try:
            inspect(model, network)
        except PureLightError:
            continue
        made[f"{network} {len(made)}"] = Network(model, SIGNATURES[network])
    return made


def feed(network: Network) -> list[np.ndarray]:
    rng = np.random.default_rng(5)
    shapes = network.signature.inputs.values()
    return [rng.uniform(-2, 2, (ROWS, *shape)).astype(np.float32) for shape in shapes]


def steady(network: Network) -> tuple[np.ndarray, np.ndarray]:
    """What the reference gives, [N, ...], and where rounding has no say in it.

    Rows in which a float is no number, or larger than integers are, have no answer to compare:
    ONNX leaves open what they are converted to, and N13 what the sine of a vast angle is.
    """
    inputs = dict(zip(network.signature.inputs, feed(network), strict=True))
    model = with_all_values(network.model)
    try:
        with mock.patch.dict(reference.OPERATORS, UNSETTLED):
            trials = [reference.evaluate(model, inputs, d) for d in (np.float32, np.float64)]
    except PureLightError:  # A computed index beyond its table, which compiled code clamps.
        return np.zeros((ROWS, 1)), np.zeros((ROWS, 1), bool)
    floats = [y.reshape(ROWS, -1) for y in trials[1].values() if y.dtype == np.float64]
    good = (np.abs(np.concatenate(floats, 1)) < 2**31).all(1, keepdims=True)
    single, double = (
        np.concatenate([trial[name].reshape(ROWS, -1) for name in network.signature.outputs], 1)
        for trial in trials
    )
    with np.errstate(all="ignore"):
        return double, np.isclose(single, double, 1e-6, 1e-6) & good


def compare(seed: int, count: int, folder: Path, *flags: str) -> int:
    """How many numbers were compared, and found equal."""
    made = drawn(Random(seed), count)
    answers = Batch(made).answers({k: feed(n) for k, n in made.items()}, folder, *flags)
    compared = 0
    for name, network in made.items():
        expected, fit = steady(network)
        found = answers[name][:, : expected.shape[1]]
        np.testing.assert_allclose(
            found[fit], expected[fit], rtol=1e-4, atol=1e-4, err_msg=f"seed {seed}: {name}"
        )
        compared += int(fit.sum())
    return compared


def test_some(tmp_path: Path) -> None:
    assert compare(1, 60, tmp_path) > 1000


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 12))
def test_many_without_undefined_behaviour(seed: int, tmp_path: Path) -> None:
    """The sanitizers end the program at an index outside, or an integer that overflows."""
    flags = ("-O1", "-fsanitize=undefined,address", "-fno-sanitize-recover=all")
    assert compare(seed, 100, tmp_path, *flags) > 1000
