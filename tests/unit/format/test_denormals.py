"""Denormal numbers count as zero within the evaluator, and nowhere else."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest

from purelight_format import denormals, reference
from tests.assets import lamp

pytestmark = pytest.mark.skipif(
    not denormals.supported(), reason="the floating-point mode of this machine is not known"
)


def product() -> float:
    return float(np.float32(1e-30) * np.full(7, 1e-10, np.float32)[3])


def in_thread(action: Callable[[], None]) -> None:
    thread = threading.Thread(target=action)
    thread.start()
    thread.join()


def test_a_block_has_its_own_mode_and_gives_it_back() -> None:
    assert product() > 0
    with denormals.flushed():
        assert product() == 0
        with denormals.flushed():
            assert product() == 0
        assert product() == 0
    assert product() > 0
    with pytest.raises(ValueError, match="x"), denormals.flushed():
        raise ValueError("x")
    assert product() > 0


def test_a_mode_belongs_to_one_thread() -> None:
    found = []

    def action() -> None:
        denormals.flush()
        found.append(product())

    in_thread(action)
    assert found == [0]
    assert product() > 0


def test_the_evaluator_gives_the_same_in_either_mode() -> None:
    model = lamp.NETWORKS["appearance"]().SerializeToString()
    rows = {
        name: np.full((3, 3), value, np.float32)
        for name, value in (("position", 1e-39), ("normal", 1e-20), ("outgoing", 0.5))
    }
    before = reference.evaluate(model, rows, np.float32)
    with denormals.flushed():
        after = reference.evaluate(model, rows, np.float32)
    assert all((before[name] == after[name]).all() for name in before)
    assert product() > 0
