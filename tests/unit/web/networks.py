"""Networks with what Python says of them, for the page's translator.

Every operator by the cases of tests/unit/format/test_operators.py, and networks that are drawn and
damaged at random by tests/fuzz.
"""

from __future__ import annotations

import base64
from collections.abc import Iterator
from random import Random
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError
from purelight_format.networks import reference
from purelight_format.networks.profile import inspect
from purelight_format.networks.vectors import SIGNATURES
from tests.fuzz import graphs
from tests.fuzz.networks import damaged
from tests.unit.format.test_operators import CASES, CONSTANTS

NETWORK = "appearance"
ROWS = 7
DRAWN = 160


def made() -> list[dict[str, Any]]:
    """All networks."""
    rng = Random(7)
    drawn = [(f"drawn {k}", graphs.drawn(rng)) for k in range(DRAWN)]
    spoilt = [(f"damaged {k}", damaged(data, rng)) for k, (_, data) in enumerate(drawn)]
    return [described(name, data) for name, data in [*operators(), *wide(), *drawn, *spoilt]]


def described(name: str, data: bytes) -> dict[str, Any]:
    """A network with its verdict, and values where rounding does not change them."""
    entry: dict[str, Any] = {"name": name, "onnx": base64.b64encode(data).decode()}
    try:
        cost = inspect(data, NETWORK)
    except FormatError as error:
        return entry | {"code": error.issue.code.name, "message": error.issue.message}
    entry["cost"] = [cost.macs_per_sample, cost.floats_per_sample, cost.nanoseconds]
    entry["warnings"] = [found.code.name for found in cost.warnings]
    feed = inputs()
    entry["inputs"] = {k: packed(v, "<f4") for k, v in feed.items()}
    try:
        short, exact = (reference.evaluate(data, feed, t)["radiance"] for t in (np.float32, float))
    except PureLightError:
        return entry | {"broken": True}
    if np.isfinite(exact).all() and np.allclose(short, exact, 1e-5, 1e-5):
        entry["outputs"] = packed(exact, "<f8")
    return entry


def packed(array: np.ndarray, dtype: str) -> str:
    return base64.b64encode(np.asarray(array).astype(dtype).tobytes()).decode()


def inputs() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(11)
    shapes = SIGNATURES[NETWORK].inputs
    return {k: rng.standard_normal((ROWS, *v)).astype(np.float32) for k, v in shapes.items()}


# Operators


def operators() -> Iterator[tuple[str, bytes]]:
    """Each case between the inputs and the output of the appearance."""
    for name, (nodes, shape) in CASES.items():
        yield name, wrapped(list(nodes), CONSTANTS, shape)


def wrapped(nodes: list[Any], constants: dict[str, Any], shape: tuple[int, ...]) -> bytes:
    """Nodes from x, y [N, 4] and w [N, 1] to z, as a network."""
    node, size = helper.make_node, int(np.prod(shape, dtype=int))
    before = [
        node("Slice", ["normal", "w_0", "w_1", "w_1"], ["n0"]),
        node("Slice", ["outgoing", "w_0", "w_1", "w_1"], ["o0"]),
        node("Slice", ["outgoing", "w_2", "w_3", "w_1"], ["w"]),
        node("Concat", ["position", "n0"], ["x"], axis=1),
        node("Concat", ["normal", "o0"], ["y"], axis=1),
    ]
    after = [
        node("Cast", ["z"], ["w_z"], to=TensorProto.FLOAT),
        node("Reshape", ["w_z", "w_flat"], ["w_row"]),
        node("MatMul", ["w_row", "w_weight"], ["radiance"]),
    ]
    weight = np.cos(np.arange(size * 3)).reshape(size, 3).astype(np.float32)
    own = {"w_flat": np.array([-1, size]), "w_weight": weight}
    own |= {f"w_{k}": np.array([k]) for k in range(4)}
    return model([*before, *nodes, *after], {**constants, **own})


def model(nodes: list[Any], constants: dict[str, Any]) -> bytes:
    used = {name for made in nodes for name in made.input}
    own = [numpy_helper.from_array(np.asarray(v), k) for k, v in constants.items() if k in used]
    ports = [
        [helper.make_tensor_value_info(k, TensorProto.FLOAT, ["N", *v]) for k, v in shapes.items()]
        for shapes in SIGNATURES[NETWORK]
    ]
    graph = helper.make_graph(nodes, "g", *ports, own)
    opset = [helper.make_opsetid("", 18)]
    made: onnx.ModelProto = helper.make_model(graph, opset_imports=opset, ir_version=10)
    return made.SerializeToString()


def tensors(floats: dict[str, np.ndarray]) -> list[onnx.TensorProto]:
    """Initializers of float32."""
    return [numpy_helper.from_array(v.astype(np.float32), k) for k, v in floats.items()]


def wide() -> Iterator[tuple[str, bytes]]:
    """What needs more than four columns: arrays of vectors, long sums, numbers of 64 bits."""
    node, rng = helper.make_node, np.random.default_rng(5)
    for width in (9, 30, 64, 257):
        nodes = [
            node("Gemm", ["x", "w1", "b1"], ["h"], transB=1), node("Relu", ["h"], ["r"]),
            node("Mul", ["r", "scale"], ["m"]), node("Sigmoid", ["m"], ["s"]),
            node("Add", ["s", "r"], ["a"]), node("Div", ["a", "number"], ["d"]),
            node("Gemm", ["d", "w2", "b2"], ["e"], transB=1), node("Exp", ["e"], ["z"]),
        ]  # fmt: skip
        constants = {
            "w1": rng.normal(size=(width, 4)), "b1": rng.normal(size=width),
            "scale": rng.normal(size=width), "number": [3.0],
            "w2": rng.normal(size=(width, width)) / width, "b2": rng.normal(size=width),
        }  # fmt: skip
        floats = {k: np.asarray(v, np.float32) for k, v in constants.items()}
        yield f"layers of {width}", wrapped(nodes, floats, (width,))
    for columns in (1, 2, 3, 5, 40):
        table = rng.normal(size=(300, columns)).astype(np.float32)
        yield f"rows of {columns}", wrapped(
            [*_index(300), node("Gather", ["table", "i"], ["z"])], {"table": table, **_HUNDRED},
            (4, columns),
        )  # fmt: skip
    for dtype, name in ((np.int32, "32"), (np.int64, "64")):
        numbers = rng.integers(-(2**30), 2**30, (50, 3)).astype(dtype)
        nodes = [
            *_index(50),
            node("Gather", ["table", "i"], ["g"]),
            node("Cast", ["g"], ["z"], to=1),
        ]
        yield (
            f"whole numbers of {name} bits",
            wrapped(nodes, {"table": numbers, **_HUNDRED}, (4, 3)),
        )
    for op, number in (("Mul", 2**40 + 12345), ("Add", 2**55), ("Sub", 2**61), ("Max", 2**45)):
        nodes = [
            *_index(1000), node("Mul", ["i", "large"], ["l"]), node(op, ["l", "given"], ["m"]),
            node("Sub", ["m", "half"], ["n"]), node("Div", ["n", "divisor"], ["q"]),
            node("Mod", ["n", "divisor"], ["r"]), node("Abs", ["n"], ["p"]),
            node("Less", ["n", "given"], ["b"]), node("Where", ["b", "q", "r"], ["s"]),
            node("Cast", ["s"], ["z"], to=1),
        ]  # fmt: skip
        constants = {
            "large": np.array([2**35 + 7]),
            "given": np.array([number]),
            "half": np.array([2**50]),
            "divisor": np.array([1_000_003]),
            **_HUNDRED,
        }
        yield f"{op} of large numbers", wrapped(nodes, constants, (4,))


_HUNDRED = {"hundred": np.array([100.0], np.float32)}


def _index(size: int) -> list[Any]:
    """Whole numbers of 64 bits below a size, from x."""
    node = helper.make_node
    scale = node("Mul", ["x", "hundred"], ["x100"])
    return [scale, node("Cast", ["x100"], ["j"], to=TensorProto.INT64), node("Abs", ["j"], ["k"]),
            node("Mod", ["k", f"size{size}"], ["i"])]  # fmt: skip


_HUNDRED |= {f"size{size}": np.array([size]) for size in (50, 300, 1000)}
