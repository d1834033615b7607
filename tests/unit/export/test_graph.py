"""The ONNX builder."""

from __future__ import annotations

import numpy as np
import onnx
import pytest

from purelight_export.graph import Graph
from purelight_onnx.session import Session


def network() -> Graph:
    graph = Graph("network")
    x = graph.input("x", 3)
    y = graph.relu(graph.linear(x, np.eye(2, 3), np.zeros(2)))
    graph.output("y", (y + 1.0) * (y + 1.0) - graph.constant([1.0, 2.0]))
    graph.exp(x * 7.0)
    return graph


def test_the_same_graph_gives_the_same_bytes() -> None:
    assert network().to_bytes() == network().to_bytes()


def test_equal_nodes_and_unused_ones_are_not_written() -> None:
    graph = onnx.load_from_string(network().to_bytes()).graph
    assert [node.op_type for node in graph.node] == [
        "Gemm",
        "Relu",
        "Add",
        "Mul",
        "Sub",
        "Identity",
    ]
    assert len(graph.initializer) == 4


def test_the_network_is_plain_onnx() -> None:
    model = onnx.load_from_string(network().to_bytes())
    onnx.checker.check_model(model, full_check=True)
    assert (model.ir_version, model.opset_import[0].version) == (10, 18)
    assert len(model.opset_import) == 1
    assert not model.metadata_props
    assert not any(node.metadata_props or node.doc_string for node in model.graph.node)
    dims = [d.dim_param or d.dim_value for d in model.graph.input[0].type.tensor_type.shape.dim]
    assert dims == ["N", 3]


def test_numbers_on_either_side_become_constants() -> None:
    graph = Graph("network")
    x = graph.input("x", 1)
    graph.output("y", 1.0 / (2.0 - x) + (-x) / 4.0)
    x0 = np.array([[0.0], [1.0], [-2.0]], np.float32)
    expected = 1 / (2 - x0) - x0 / 4
    np.testing.assert_allclose(Session(graph.to_bytes())({"x": x0})["y"], expected)


def test_selections_follow_numpy() -> None:
    graph = Graph("network")
    x = graph.input("x", 4)
    a, b = graph.split(x, [1, 3])
    index = graph.cast(graph.sum(graph.cast(b > a, np.int32)), np.int64)
    graph.output("picked", graph.pick(x, index))
    graph.output("columns", graph.gather_columns(x, [3, 0, 3]))
    graph.output("flat", graph.flatten(graph.slice(x, 2, 3)))
    graph.output("sums", graph.cumulative_sum(x, exclusive=True))
    graph.output("moved", graph.channels_last(graph.reshape(x, 2, 1, 2)))
    v = np.random.default_rng(0).random((9, 4)).astype(np.float32)
    result = Session(graph.to_bytes())({"x": v})
    count = (v[:, 1:] > v[:, :1]).sum(1)
    np.testing.assert_array_equal(result["picked"][:, 0], v[np.arange(9), count])
    np.testing.assert_array_equal(result["columns"], v[:, [3, 0, 3]])
    np.testing.assert_array_equal(result["flat"], v[:, 2])
    expected = np.cumsum(np.pad(v, ((0, 0), (1, 0))), 1)[:, :4]
    np.testing.assert_allclose(result["sums"], expected, rtol=1e-6)
    np.testing.assert_array_equal(result["moved"], v.reshape(9, 2, 1, 2).transpose(0, 2, 3, 1))


def test_shapes_that_do_not_fit_are_refused_while_building() -> None:
    graph = Graph("network")
    x = graph.input("x", 3)
    with pytest.raises(ValueError):
        graph.binary("Add", x, np.zeros(2))
