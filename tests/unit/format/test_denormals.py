"""Denormal numbers count as zero within the evaluator, and nowhere else."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from purelight_format.networks import denormals, reference

pytestmark = pytest.mark.skipif(
    not denormals.supported(), reason="the floating-point mode of this machine is not known"
)


def product() -> float:
    return float(np.float32(1e-30) * np.full(7, 1e-10, np.float32)[3])


def squared() -> bytes:
    """A network whose intermediate 1e-10 x is denormal for x = 1e-30, and its result is not."""
    tensors = [numpy_helper.from_array(np.float32(v), k) for k, v in (("a", 1e-10), ("b", 1e20))]
    nodes = [helper.make_node("Mul", ["x", "a"], ["z"]), helper.make_node("Mul", ["z", "b"], ["y"])]
    ends = [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["N", 1]) for name in "xy"]
    graph = helper.make_graph(nodes, "g", ends[:1], ends[1:], tensors)
    return helper.make_model(graph).SerializeToString()


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
    rows = {"x": np.full((3, 1), 1e-30, np.float32)}
    before = reference.evaluate(squared(), rows, np.float32)["y"]
    with denormals.flushed():
        after = reference.evaluate(squared(), rows, np.float32)["y"]
    np.testing.assert_array_equal(before, after)
    assert product() > 0
