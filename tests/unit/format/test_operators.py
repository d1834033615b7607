"""Every operator of the profile: its rule and the reference evaluator against two others."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper, numpy_helper
from onnx.reference import ReferenceEvaluator

from purelight_format.networks import reference
from purelight_format.networks.operators import OPERATORS
from purelight_format.networks.profile import inspect
from purelight_format.networks.vectors import SIGNATURES, Signature

ROWS = 5
FLOAT, INT32, INT64, BOOL = (
    TensorProto.FLOAT, TensorProto.INT32, TensorProto.INT64, TensorProto.BOOL
)  # fmt: skip
F = np.float32


def node(op: str, inputs: str, outputs: str = "z", **attributes: Any) -> onnx.NodeProto:
    names = [name if name != "_" else "" for name in inputs.split()]
    return helper.make_node(op, names, outputs.split(), **attributes)


INTEGERS = [node("Mul", "x ten", "x10"), node("Cast", "x10", "i", to=INT64)]
FLAGS = [node("Greater", "x y", "p"), node("Less", "x half", "q")]
UNIT = [node("Clip", "x minus one", "c")]

# Nodes, and the shape of one sample of z.
Case = tuple[list[onnx.NodeProto], tuple[int, ...]]
CASES: dict[str, Case] = {
    **{op: ([node(op, "x")], (4,)) for op in (
        "Abs", "Atan", "Cos", "Exp", "Floor", "Identity", "Neg", "Relu", "Sigmoid", "Sign",
        "Sin", "Reciprocal")},
    **{op: ([node(op, "x y")], (4,)) for op in ("Add", "Div", "Max", "Min", "Mul", "Sub")},
    "Asin": ([*UNIT, node("Asin", "c")], (4,)),
    "Log": ([node("Exp", "x", "e"), node("Log", "e")], (4,)),
    "Sqrt": ([node("Exp", "x", "e"), node("Sqrt", "e")], (4,)),
    "Neg of integers": ([*INTEGERS, node("Neg", "i")], (4,)),
    "Add of a constant": ([node("Add", "x row")], (4,)),
    "Add of a constant with an axis for the rows": ([node("Add", "x rows")], (4,)),
    "Add that widens": ([node("Add", "w x")], (4,)),
    "Sub from a number": ([node("Sub", "half x")], (4,)),
    "Max of three": ([node("Max", "x y half")], (4,)),
    "Min of one": ([node("Min", "x")], (4,)),
    "Div of integers": ([*INTEGERS, node("Div", "i three")], (4,)),
    "Mod": ([*INTEGERS, node("Mod", "i three")], (4,)),
    "Mod of 32 bits": (
        [node("Mul", "x ten", "x10"), node("Cast", "x10", "i", to=INT32), node("Mod", "i small")],
        (4,)),
    "Mod of floats": ([node("Mod", "x half", fmod=1)], (4,)),
    "And": ([*FLAGS, node("And", "p q")], (4,)),
    "Or": ([*FLAGS, node("Or", "p q")], (4,)),
    "Not": ([*FLAGS, node("Not", "p")], (4,)),
    **{op: ([node(op, "x y")], (4,)) for op in
       ("Greater", "GreaterOrEqual", "Less", "LessOrEqual")},
    "Equal": ([*INTEGERS, node("Equal", "i three")], (4,)),
    "Where": ([*FLAGS, node("Where", "p x half")], (4,)),
    "Where of integers": ([*FLAGS, *INTEGERS, node("Where", "p i three")], (4,)),
    "Cast": ([*INTEGERS, node("Cast", "i", to=FLOAT)], (4,)),
    "Cast to bool": ([node("Cast", "x", to=BOOL)], (4,)),
    "Cast from bool": ([*FLAGS, node("Cast", "p", to=INT32)], (4,)),
    "Clip": ([node("Clip", "x minus half0")], (4,)),
    "Clip above": ([node("Clip", "x _ half0")], (4,)),
    "Clip below": ([node("Clip", "x half0")], (4,)),
    "Concat": ([node("Concat", "x w y", axis=1)], (9,)),
    "Concat from behind": ([node("Concat", "x y", axis=-1)], (8,)),
    "CumSum": ([node("CumSum", "x axis1")], (4,)),
    "CumSum exclusive": ([node("CumSum", "x axis1", exclusive=1)], (4,)),
    "CumSum reverse": ([node("CumSum", "x axis1", reverse=1, exclusive=1)], (4,)),
    "Gather": ([*INTEGERS, node("Mod", "i three", "j"), node("Gather", "table j")], (4,)),
    "Gather of rows": (
        [*INTEGERS, node("Mod", "i three", "j"), node("Gather", "matrix j")], (4, 4)),
    "Gather of columns": ([node("Gather", "x columns", axis=1)], (3,)),
    "GatherElements": (
        [*INTEGERS, node("Mod", "i three", "j"), node("GatherElements", "x j", axis=1)], (4,)),
    "Gemm": ([node("Gemm", "x matrix bias", transB=1)], (3,)),
    "MatMul": ([node("MatMul", "x square")], (2,)),
    "ReduceMax": ([node("ReduceMax", "x axes1", keepdims=0)], ()),
    "ReduceSum": ([node("ReduceSum", "x axes1")], (1,)),
    "ReduceSum of the last": ([node("ReduceSum", "x last", keepdims=1)], (1,)),
    "Reshape": ([node("Reshape", "x shape")], (2, 2)),
    "Reshape of a copied size": ([node("Reshape", "x shape0")], (2, 2, 1)),
    "Slice": ([node("Slice", "x from to axes1")], (2,)),
    "Slice by steps": ([node("Slice", "x from end axes1 two")], (2,)),
    "Softmax": ([node("Softmax", "x", axis=1)], (4,)),
    "Softmax of large values": ([node("Mul", "x huge", "h"), node("Softmax", "h")], (4,)),
    "Split": ([node("Split", "x sizes", "u z", axis=1)], (3,)),
    "Squeeze": ([node("Squeeze", "w axes1")], ()),
    "Transpose": (
        [node("Reshape", "x shape", "m"), node("Transpose", "m", perm=[0, 2, 1])], (2, 2)),
    "Unsqueeze": ([node("Unsqueeze", "x axes1")], (1, 4)),
    "Unsqueeze from behind": ([node("Unsqueeze", "x last")], (4, 1)),
}  # fmt: skip

CONSTANTS: dict[str, Any] = {
    "row": F([1, -2, 3, 0.5]), "rows": F([[1, -2, 3, 0.5]]), "half": F([0.5]), "half0": F(0.5),
    "one": F(1), "minus": F(-1), "ten": F([10]), "huge": F([1e4]), "three": np.array([3]),
    "small": np.array([3], np.int32), "axis1": np.array(1), "axes1": np.array([1]),
    "last": np.array([-1]), "table": F([7, 8, 9]), "matrix": F(np.arange(12).reshape(3, 4)),
    "columns": np.array([3, 0, -2]), "bias": F([1, 2, 3]), "square": F(np.arange(8).reshape(4, 2)),
    "shape": np.array([-1, 2, 2]), "shape0": np.array([0, 2, 2, 1]), "from": np.array([1]),
    "to": np.array([3]), "end": np.array([1000]), "two": np.array([2]), "sizes": np.array([1, 3]),
}  # fmt: skip


def model(nodes: list[onnx.NodeProto], shape: tuple[int, ...]) -> bytes:
    """A network that ends in float32, as all do."""
    used = {name for made in nodes for name in made.input}
    tensors = [numpy_helper.from_array(np.asarray(v), k) for k, v in CONSTANTS.items() if k in used]
    info = helper.make_tensor_value_info
    inputs = [info(k, FLOAT, ["N", size]) for k, size in (("x", 4), ("y", 4), ("w", 1))]
    graph = helper.make_graph(
        [*nodes, node("Cast", "z", "result", to=FLOAT)],
        "operator", inputs, [info("result", FLOAT, ["N", *shape])], tensors,
    )  # fmt: skip
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()


def inputs(rows: int = ROWS) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(11)
    x, y = (rng.standard_normal((rows, 4)).astype(F) for _ in range(2))
    y[:2] = x[:2]
    return {"x": x, "y": y, "w": rng.standard_normal((rows, 1)).astype(F)}


def others(data: bytes, feed: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    proto = onnx.load_from_string(data)
    return {
        "ONNX Runtime": session.run(["result"], feed)[0],
        "onnx.reference": ReferenceEvaluator(proto).run(["result"], feed)[0],
    }


@pytest.mark.parametrize("name", CASES)
def test_the_reference_evaluator_equals_two_others(name: str) -> None:
    nodes, shape = CASES[name]
    data, feed = model(nodes, shape), inputs()
    with np.errstate(all="ignore"):
        expected = others(data, feed)
    for dtype, tolerance in ((np.float32, 1e-6), (np.float64, 1e-5)):
        result = reference.evaluate(data, feed, dtype)["result"]
        assert result.dtype == dtype
        assert result.shape == (ROWS, *shape)
        for other in expected.values():
            np.testing.assert_allclose(result, other, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("rows", [0, 1])
@pytest.mark.parametrize("name", CASES)
def test_the_rule_foretells_the_shape(
    name: str, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    nodes, shape = CASES[name]
    data = model(nodes, shape)
    signature = Signature({"x": (4,), "y": (4,), "w": (1,)}, {"result": shape})
    monkeypatch.setitem(SIGNATURES, "operator", signature)
    cost = inspect(data, "operator")
    onnx.checker.check_model(onnx.load_from_string(data), full_check=True)
    assert reference.evaluate(data, inputs(rows))["result"].shape == (rows, *shape)
    assert cost.floats_per_sample >= max(1, int(np.prod(shape)))


def test_every_operator_has_a_case_and_an_evaluator() -> None:
    tested = {made.op_type for nodes, _ in CASES.values() for made in nodes}
    assert tested == set(OPERATORS) == set(reference.OPERATORS)


def test_rows_do_not_influence_each_other() -> None:
    for nodes, shape in CASES.values():
        data, feed = model(nodes, shape), inputs()
        whole = reference.evaluate(data, feed)["result"]
        alone = reference.evaluate(data, {k: v[2:3] for k, v in feed.items()})["result"]
        np.testing.assert_allclose(whole[2:3], alone, rtol=1e-12)


def test_products_are_counted_per_row(monkeypatch: pytest.MonkeyPatch) -> None:
    signature = Signature({"x": (4,), "y": (4,), "w": (1,)}, {"result": (3,)})
    monkeypatch.setitem(SIGNATURES, "operator", signature)
    cost = inspect(model(CASES["Gemm"][0], (3,)), "operator")
    assert (cost.macs_per_sample, cost.floats_per_sample) == (12, 6)
