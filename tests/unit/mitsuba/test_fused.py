"""The translated networks against ONNX Runtime."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import onnxruntime
import pytest
from onnx import TensorProto, helper, numpy_helper

from purelight_format.errors import PureLightError
from purelight_mitsuba.translate.network import FusedNetwork

ROWS = 67
TOLERANCE = 1e-4
F32 = np.float32


def model(
    nodes: Sequence[Any], constants: dict[str, np.ndarray], shape: Sequence[int] = (3,)
) -> bytes:
    """A network with inputs x, y [N, 3] and one output z [N, *shape]."""
    inputs = [helper.make_tensor_value_info(n, TensorProto.FLOAT, ["N", 3]) for n in ("x", "y")]
    output = helper.make_tensor_value_info("z", TensorProto.FLOAT, ["N", *shape])
    initializers = [numpy_helper.from_array(np.asarray(a), name) for name, a in constants.items()]
    graph = helper.make_graph(list(nodes), "test", inputs, [output], initializers)
    opset = [helper.make_opsetid("", 18)]
    return helper.make_model(graph, opset_imports=opset, ir_version=10).SerializeToString()


def both(network: bytes, low: float = -2.0, high: float = 2.0) -> tuple[np.ndarray, np.ndarray]:
    """The output by Dr.Jit and by ONNX Runtime, flattened to [N, D]."""
    x, y = np.random.default_rng(1).uniform(low, high, (2, ROWS, 3)).astype(np.float32)
    (columns,) = FusedNetwork(network)(mi.Point3f(x.T), mi.Point3f(y.T))
    ours = np.stack([np.array(value + dr.zeros(mi.Float, ROWS)) for value in columns.ravel()], 1)
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(network, options)
    (theirs,) = session.run(None, {"x": x, "y": y})
    return ours, theirs.reshape(ROWS, -1)


def check(nodes: Sequence[Any], shape: Sequence[int] = (3,), **constants: Any) -> None:
    low = constants.pop("low", -2.0)
    ours, theirs = both(model(nodes, constants, shape), low)
    np.testing.assert_allclose(ours, theirs, rtol=TOLERANCE, atol=TOLERANCE)


def node(op: str, inputs: str, output: str = "z", **attributes: Any) -> Any:
    return helper.make_node(op, inputs.split(), output.split(), **attributes)


@pytest.mark.parametrize(
    "op",
    ["Abs", "Atan", "Cos", "Exp", "Floor", "Identity", "Neg", "Relu", "Sigmoid", "Sign", "Sin"],
)
def test_functions_of_any_number(op: str) -> None:
    check([node(op, "x")])


@pytest.mark.parametrize("op", ["Log", "Reciprocal", "Sqrt"])
def test_functions_of_positive_numbers(op: str) -> None:
    check([node(op, "x")], low=0.1)


def test_asin() -> None:
    check([node("Mul", "x half", "h"), node("Asin", "h")], half=np.float32(0.49))


@pytest.mark.parametrize("op", ["Add", "Div", "Max", "Min", "Mul", "Sub"])
@pytest.mark.parametrize("shape", [(), (1,), (3,), (1, 3)])
def test_arithmetic_broadcasts_constants(op: str, shape: tuple[int, ...]) -> None:
    check([node(op, "x c", "t"), node(op, "t y")], c=np.full(shape, 1.5, np.float32))


@pytest.mark.parametrize("op", ["Less", "LessOrEqual", "Greater", "GreaterOrEqual", "Equal"])
def test_comparisons(op: str) -> None:
    nodes = [node("Floor", "x", "a"), node("Floor", "y", "b"), node(op, "a b", "m")]
    check([*nodes, node("Where", "m x c")], c=np.float32(7))


def test_logic_and_casts() -> None:
    nodes = [
        node("Cast", "x", "i", to=TensorProto.INT32),
        node("Cast", "i", "p", to=TensorProto.BOOL),
        node("Greater", "y zero", "q"),
        node("And", "p q", "a"),
        node("Not", "q", "n"),
        node("Or", "a n", "o"),
        node("Cast", "o", "z", to=TensorProto.FLOAT),
    ]
    check(nodes, zero=np.float32(0))


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
@pytest.mark.parametrize("op", ["Mod", "Div"])
@pytest.mark.parametrize("divisor", [3, -3])
def test_integers_of_both_signs(dtype: Any, op: str, divisor: int) -> None:
    to = TensorProto.INT32 if dtype is np.int32 else TensorProto.INT64
    nodes = [
        node("Mul", "x ten", "t"),
        node("Cast", "t", "i", to=to),
        node(op, "i d", "r"),
        node("Cast", "r", "z", to=TensorProto.FLOAT),
    ]
    check(nodes, ten=np.float32(10), d=np.array([divisor], dtype))


def test_float_remainder_keeps_the_sign_of_the_dividend() -> None:
    check([node("Mod", "x c", fmod=1)], c=np.float32(0.7))


@pytest.mark.parametrize("divisor", [0.7, -3.0, np.inf])
@pytest.mark.parametrize("low", [-2.0, 0.1])
def test_float_remainder_of_any_divisor(divisor: float, low: float) -> None:
    check([node("Mod", "c x", "r", fmod=1), node("Mod", "r c", fmod=1)], low=low, c=F32(divisor))


@pytest.mark.parametrize("by", [1e3, 1e5, 1e7, 1e9, 1e20, 1e38])
def test_what_vast_numbers_leave_is_bounded(by: float) -> None:
    """A sine stays within one and a remainder below its divisor, where no digit can be right."""
    x = np.random.default_rng(1).uniform(-2, 2, (2, ROWS, 3)).astype(np.float32)[0]
    for op in ("Sin", "Cos"):
        ours, theirs = both(model([node("Mul", "x by", "v"), node(op, "v")], {"by": F32(by)}))
        assert (np.abs(ours) <= 1).all()
        apart = np.spacing(np.abs(x * F32(by)))  # of the angle from the next
        assert (np.abs(ours - theirs) <= 1e-6 + apart).all()
    remainder = node("Mod", "v y", fmod=1)
    ours, _ = both(model([node("Mul", "x by", "v"), remainder], {"by": F32(by)}))
    assert (np.abs(ours) <= 2).all()


@pytest.mark.parametrize("op", ["Sin", "Cos"])
def test_an_endless_angle_has_no_sine(op: str) -> None:
    nodes = [node("Sub", "x x", "none"), node("Reciprocal", "none", "v"), node(op, "v")]
    ours, _ = both(model(nodes, {}))
    assert np.isnan(ours).all()


@pytest.mark.parametrize("exclusive", [0, 1])
@pytest.mark.parametrize("reverse", [0, 1])
def test_cumulative_sum(exclusive: int, reverse: int) -> None:
    check([node("CumSum", "x axis", exclusive=exclusive, reverse=reverse)], axis=np.int64(1))


@pytest.mark.parametrize("op", ["ReduceSum", "ReduceMax"])
@pytest.mark.parametrize("keep", [0, 1])
def test_reductions(op: str, keep: int) -> None:
    check([node(op, "x axes", keepdims=keep)], (1,) * keep, axes=np.array([-1], np.int64))


@pytest.mark.parametrize("axis", [1, -1])
def test_softmax(axis: int) -> None:
    check([node("Softmax", "x", axis=axis)])


def test_clip_at_one_end_and_both() -> None:
    nodes = [node("Clip", "x least most", "t"), helper.make_node("Clip", ["t", "", "mid"], ["z"])]
    check(nodes, least=np.float32(-1), most=np.float32(1), mid=np.float32(0.5))


def test_columns_are_moved() -> None:
    nodes = [
        node("Concat", "x y", "c", axis=1),
        node("Split", "c sizes", "a b", axis=1),
        node("Gather", "a order", "g", axis=1),
        node("Unsqueeze", "b axes", "u"),
        node("Squeeze", "u axes", "s"),
        node("Concat", "g s", "t", axis=-1),
        node("Slice", "t starts ends axes1 steps", "z"),
    ]
    check(
        nodes,
        (3,),
        sizes=np.array([2, 4], np.int64),
        order=np.array([1, 0], np.int64),
        axes=np.array([2], np.int64),
        starts=np.array([5], np.int64),
        ends=np.array([-6], np.int64),
        axes1=np.array([1], np.int64),
        steps=np.array([-2], np.int64),
    )


def test_reshape_and_transpose() -> None:
    nodes = [
        node("Concat", "x y", "c", axis=1),
        node("Reshape", "c sizes", "r"),
        node("Transpose", "r", "z", perm=[0, 2, 1]),
    ]
    check(nodes, (2, 3), sizes=np.array([-1, 3, 2], np.int64))


@pytest.mark.parametrize("width", [None, 1, 3, 4])
@pytest.mark.parametrize("to", [TensorProto.INT32, TensorProto.INT64])
def test_table(width: int | None, to: int) -> None:
    size = (9,) if width is None else (9, width)
    table = np.random.default_rng(0).normal(size=size).astype(np.float32)
    nodes = [
        node("Mul", "x two", "t"),
        node("Add", "t four", "f"),
        node("Cast", "f", "i", to=to),
        node("Gather", "table i"),
    ]
    check(nodes, (3, *size[1:]), table=table, two=np.float32(2), four=np.float32(4))


def test_integer_table() -> None:
    nodes = [
        node("Abs", "x", "a"),
        node("Cast", "a", "i", to=TensorProto.INT32),
        node("Gather", "table i", "g"),
        node("Cast", "g", "z", to=TensorProto.FLOAT),
    ]
    check(nodes, table=np.array([5, 1 << 20, -7], np.int32))


def test_index_outside_a_table_reads_inside() -> None:
    nodes = [
        node("Mul", "x huge", "t"),
        node("Cast", "t", "i", to=TensorProto.INT32),
        node("Gather", "table i"),
    ]
    network = model(nodes, {"table": np.float32([3.0, 3.0]), "huge": np.float32(1e8)})
    x = mi.Point3f(np.random.default_rng(0).normal(size=(3, ROWS)).astype(np.float32))
    (columns,) = FusedNetwork(network)(x, x)
    assert all(np.array_equal(np.array(c), np.full(ROWS, 3.0)) for c in columns)


def test_column_picked_by_each_row() -> None:
    nodes = [
        node("Abs", "x", "a"),
        node("Cast", "a", "i", to=TensorProto.INT64),
        node("GatherElements", "y i", axis=1),
    ]
    check(nodes)


def test_column_picked_along_one_of_two_axes_and_from_behind() -> None:
    nodes = [
        node("Reshape", "x s", "a"),
        node("Cast", "a", "i", to=TensorProto.INT32),
        node("Clip", "i least most", "j"),
        node("GatherElements", "a j", "b", axis=1),
        node("Reshape", "b t"),
    ]
    check(nodes, s=np.array([-1, 3, 1]), t=np.array([-1, 3]),
          least=np.int32(-3), most=np.int32(2))  # fmt: skip


@pytest.mark.parametrize("dtype", [np.float32, np.int32, np.int64, np.bool_])
@pytest.mark.parametrize("columns", [1, 3])
def test_table_of_every_type_also_from_behind(dtype: type, columns: int) -> None:
    table = np.arange(5 * columns).reshape(5, columns).astype(dtype)
    nodes = [
        node("Cast", "x", "i", to=TensorProto.INT64),
        node("Clip", "i least most", "j"),
        node("Gather", "table j", "a"),
        node("Cast", "a", "b", to=TensorProto.FLOAT),
        node("ReduceSum", "b last", "z", keepdims=0),
    ]
    check(nodes, table=table, least=np.int64(-5), most=np.int64(4), last=np.array([2]))


def test_remainder_of_nearly_whole_quotients_keeps_its_sign() -> None:
    nodes = [
        node("Mul", "x zero", "a"),
        node("Add", "a divisor", "b"),
        node("Mod", "c b", fmod=1),
    ]
    check(nodes, zero=np.float32(0), divisor=np.float32(0.3), c=np.float32([3, -3, 0.9]))


def test_constants_may_come_first() -> None:
    check([node("Max", "c d x")], c=np.float32(-0.2), d=np.array([0.1, 0.2, 0.3], np.float32))


def layers(widths: Sequence[int], rng: np.random.Generator) -> tuple[list[Any], dict[str, Any]]:
    """A ReLU network from c [N, 6] to z, whose first layer is a sum of two."""
    sizes = [6, *widths]
    nodes, constants = [], {}
    for k, (a, b) in enumerate(pairwise(sizes)):
        constants[f"w{k}"] = (rng.normal(size=(b, a)) / np.sqrt(a)).astype(np.float32)
        constants[f"b{k}"] = rng.normal(size=b).astype(np.float32)
        last = k == len(widths) - 1
        source = "c" if k == 0 else f"r{k - 1}"
        nodes.append(node("Gemm", f"{source} w{k} b{k}", "z" if last else f"g{k}", transB=1))
        if not last:
            nodes.append(node("Relu", f"g{k}", f"r{k}"))
    return nodes, constants


@pytest.mark.parametrize("widths", [[3], [32, 3], [64, 64, 64, 3], [17, 5, 1]])
def test_random_networks(widths: list[int]) -> None:
    nodes, constants = layers(widths, np.random.default_rng(len(widths)))
    check([node("Concat", "x y", "c", axis=1), *nodes], (widths[-1],), **constants)


@pytest.mark.parametrize("inputs", [3, 6])
def test_matrix_product_and_scaled_layer(inputs: int) -> None:
    rng = np.random.default_rng(3)
    matrix = rng.normal(size=(inputs, 5)).astype(np.float32)
    first = [node("Concat", "x y", "c", axis=1)] if inputs == 6 else [node("Identity", "x", "c")]
    nodes = [
        *first,
        node("MatMul", "c m", "a"),
        node("Gemm", "a w b", "d", transB=1, alpha=0.5, beta=2.0),
        node("Add", "d d", "z"),
    ]
    weight, bias = rng.normal(size=(7, 5)).astype(np.float32), np.arange(7, dtype=np.float32)
    check(nodes, (7,), m=matrix, w=weight, b=bias)


def test_a_layer_of_one_number_is_added_to_all_of_another() -> None:
    rng = np.random.default_rng(5)
    constants = {"w": rng.normal(size=(16, 6)), "b": rng.normal(size=16),
                 "w1": rng.normal(size=(1, 6)), "b1": rng.normal(size=1)}  # fmt: skip
    nodes = [
        node("Concat", "x y", "c", axis=1),
        node("Gemm", "c w b", "many", transB=1),
        node("Gemm", "c w1 b1", "one", transB=1),
        node("Add", "many one", "s"),
        node("Add", "one s", "z"),
    ]
    check(nodes, (16,), **{name: array.astype(np.float32) for name, array in constants.items()})


def test_outputs_that_nobody_uses_are_not_computed() -> None:
    """Of a wide layer, only the blocks that are asked for get into the kernel."""
    nodes, constants = layers([256], np.random.default_rng(4))
    wide = FusedNetwork(model([node("Concat", "x y", "c", axis=1), *nodes], constants, (256,)))
    x = mi.Point3f(np.random.default_rng(6).normal(size=(3, ROWS)).astype(np.float32))
    (columns,) = wide(x, x)
    operations = []
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        for used in (columns[:1], columns):
            dr.kernel_history_clear()
            dr.eval(sum(used[1:], used[0]))
            operations.append(sum(kernel["operation_count"] for kernel in dr.kernel_history()))
    assert operations[0] < operations[1] / 4


def test_a_network_runs_in_a_symbolic_loop() -> None:
    nodes, constants = layers([16, 3], np.random.default_rng(5))
    network = FusedNetwork(model([node("Concat", "x y", "c", axis=1), *nodes], constants))
    start = mi.Point3f(np.random.default_rng(6).normal(size=(3, ROWS)).astype(np.float32))

    def body(k: mi.UInt, x: mi.Point3f) -> tuple[mi.UInt, mi.Point3f]:
        return k + 1, mi.Point3f(*network(x, start)[0])

    _, looped = dr.while_loop((mi.UInt(0), mi.Point3f(start)), lambda k, x: k < 3, body)
    unrolled = mi.Point3f(start)
    for _ in range(3):
        unrolled = mi.Point3f(*network(unrolled, start)[0])
    np.testing.assert_allclose(np.array(looped), np.array(unrolled), rtol=1e-4, atol=1e-4)


def test_unknown_operator_is_named() -> None:
    with pytest.raises(PureLightError, match="Erf"):
        FusedNetwork(model([node("Erf", "x")], {}))


def test_bytes_that_are_no_network() -> None:
    with pytest.raises(PureLightError, match="not an ONNX model"):
        FusedNetwork(b"\xff\xfe nothing")
