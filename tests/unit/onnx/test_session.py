"""The chunked ONNX Runtime session."""

from __future__ import annotations

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from purelight_format.errors import PureLightError
from purelight_format.networks import denormals
from purelight_onnx.session import Session

WEIGHT = np.array([[1.0, 2.0, 3.0], [-1.0, 0.5, 0.25]], np.float32)


def doubled_linear() -> bytes:
    """Returns a network with outputs y = x W' + 1 of shape [N, 2] and s = sum(y) of shape [N]."""
    nodes = [
        helper.make_node("Gemm", ["x", "w", "b"], ["y"], transB=1),
        helper.make_node("ReduceSum", ["y", "axes"], ["s"], keepdims=0),
    ]
    graph = helper.make_graph(
        nodes,
        "linear",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["N", 3])],
        [
            helper.make_tensor_value_info("y", TensorProto.FLOAT, ["N", 2]),
            helper.make_tensor_value_info("s", TensorProto.FLOAT, ["N"]),
        ],
        [
            numpy_helper.from_array(WEIGHT, "w"),
            numpy_helper.from_array(np.ones(2, np.float32), "b"),
            numpy_helper.from_array(np.array([1], np.int64), "axes"),
        ],
    )
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("rows", [0, 1, 1023, 1024, 1025, 65537])
def test_every_row_is_evaluated_once_and_in_place(rows: int, threads: int) -> None:
    x = np.random.default_rng(1).standard_normal((rows, 3)).astype(np.float32)
    result = Session(doubled_linear(), threads=threads)({"x": x})
    expected = x @ WEIGHT.T + 1
    assert result["y"].shape == (rows, 2)
    assert result["s"].shape == (rows,)
    np.testing.assert_allclose(result["y"], expected, rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(result["s"], expected.sum(1), rtol=1e-5, atol=1e-4)


def test_a_row_does_not_depend_on_its_chunk() -> None:
    x = np.random.default_rng(2).standard_normal((2049, 3)).astype(np.float32)
    small = Session(doubled_linear(), chunk=64)({"x": x})["y"]
    large = Session(doubled_linear(), chunk=4096)({"x": x})["y"]
    np.testing.assert_array_equal(small, large)


def test_float64_and_strided_inputs_are_converted() -> None:
    x = np.random.default_rng(3).standard_normal((3, 5)).T
    result = Session(doubled_linear())({"x": x})
    np.testing.assert_allclose(result["y"], x @ WEIGHT.T + 1, rtol=1e-5)


@pytest.mark.parametrize(
    "inputs",
    [
        {},
        {"z": np.zeros((2, 3))},
        {"x": np.zeros((2, 4))},
        {"x": np.zeros(3)},
        {"x": np.float32(1)},
        {"x": np.zeros((2, 3)), "extra": np.zeros((2, 3))},
    ],
)
def test_wrong_inputs_are_refused_in_one_line(inputs: dict[str, np.ndarray]) -> None:
    with pytest.raises(PureLightError) as caught:
        Session(doubled_linear(), name="appearance")(inputs)
    assert "\n" not in str(caught.value)
    assert "appearance" in str(caught.value)


@pytest.mark.parametrize("model", [b"", b"not a network", b"ORTM" + bytes(64)])
def test_bytes_that_are_no_network_are_refused_in_one_line(model: bytes) -> None:
    with pytest.raises(PureLightError) as caught:
        Session(model, name="sampler")
    assert "\n" not in str(caught.value)


def test_a_network_of_a_future_opset_is_refused() -> None:
    model = onnx.load_from_string(doubled_linear())
    model.opset_import[0].version = 9999
    with pytest.raises(PureLightError):
        Session(model.SerializeToString())


def looking_up(rows: int) -> bytes:
    """Returns a network that reads a table of some rows at its input, a whole number."""
    nodes = [helper.make_node("Cast", ["x"], ["i"], to=TensorProto.INT64),
             helper.make_node("Gather", ["table", "i"], ["y"], name="a\x1b[2Jb")]  # fmt: skip
    graph = helper.make_graph(
        nodes, "table",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["N", 1])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["N", 1])],
        [numpy_helper.from_array(np.arange(rows, dtype=np.float32), "table")],
    )  # fmt: skip
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()


def test_a_fault_at_run_time_is_one_line_of_ours() -> None:
    session = Session(looking_up(4), name="lamp")
    np.testing.assert_array_equal(session({"x": [[3.0]]})["y"], [[3.0]])
    with pytest.raises(PureLightError, match=r"lamp: ONNX Runtime fails on it: .*bounds") as caught:
        session({"x": [[4.0]]})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("floats", "chunk"), [(0, 1024), (1000, 1024), (1 << 20, 8), (1 << 30, 1)])
def test_a_chunk_is_smaller_where_a_row_takes_much(floats: int, chunk: int) -> None:
    assert Session(doubled_linear(), floats=floats).chunk == chunk


@pytest.mark.skipif(not denormals.supported(), reason="this machine's mode is not known")
@pytest.mark.parametrize("threads", [1, 2])
def test_denormals_are_zero_inside_and_untouched_outside(threads: int) -> None:
    session = Session(doubled_linear(), threads=threads, chunk=2)
    tiny = np.full((64, 3), 1e-39, np.float32)
    assert (session({"x": tiny})["y"] == 1).all()
    product = Session(_product(), threads=threads, chunk=2)({"x": np.full((64, 3), 1e-30)})["y"]
    assert (product == 0).all()
    assert np.float32(1e-30) * np.float32(1e-10) > 0


def _product() -> bytes:
    """Returns a network y = 1e-10 x."""
    graph = helper.make_graph(
        [helper.make_node("Mul", ["x", "c"], ["y"])], "product",
        [helper.make_tensor_value_info("x", TensorProto.FLOAT, ["N", 3])],
        [helper.make_tensor_value_info("y", TensorProto.FLOAT, ["N", 3])],
        [numpy_helper.from_array(np.float32(1e-10), "c")],
    )  # fmt: skip
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()
