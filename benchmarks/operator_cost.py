"""Nanoseconds that one element of each operator takes, by each evaluator, against the stated cost.

python -m benchmarks.operator_cost [--width 128]

A network of many copies of one operator is timed beside the same network without it, on one
thread, with ordinary numbers and with huge ones. The last column is the most time for which the
stated cost (`purelight_format.onnx_cost`) is too low: at most 5.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from purelight_format import reference
from purelight_format.onnx_profile import IR_VERSION, OPSET, inspect
from purelight_mitsuba.platform import use

COPIES, RUNS, BAR = 8, 3, 5.0
ROWS = {"NumPy": 1024, "ONNX Runtime": 1024, "Dr.Jit": 1 << 13}
SCALES = {"ordinary": 2.0, "huge": 1e30}
NAMES = ("position", "normal", "outgoing")
FLOAT, INT32, INT64, BOOL = (
    TensorProto.FLOAT,
    TensorProto.INT32,
    TensorProto.INT64,
    TensorProto.BOOL,
)


@dataclass
class Graph:
    """A network of the profile under construction."""

    nodes: list[Any] = field(default_factory=list)
    constants: list[Any] = field(default_factory=list)

    def constant(self, value: Any, dtype: Any = np.float32) -> str:
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, dtype), name))
        return name

    def node(self, op: str, inputs: Sequence[str], outputs: int = 1, **attributes: Any) -> Any:
        names = [f"v{len(self.nodes)}_{k}" for k in range(outputs)]
        self.nodes.append(helper.make_node(op, list(inputs), names, **attributes))
        return names[0] if outputs == 1 else names

    def model(self, radiance: str) -> bytes:
        self.nodes.append(helper.make_node("Identity", [radiance], ["radiance"]))
        inputs = [helper.make_tensor_value_info(n, FLOAT, ["N", 3]) for n in NAMES]
        output = helper.make_tensor_value_info("radiance", FLOAT, ["N", 3])
        graph = helper.make_graph(self.nodes, "g", inputs, [output], self.constants)
        opsets = [helper.make_opsetid("", OPSET)]
        made = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
        data: bytes = made.SerializeToString()
        return data


@dataclass(frozen=True)
class Case:
    """One use of an operator.

    Arguments:
        build: adds it to a graph behind a value [N, width].
        dtype: of that value.
    """

    op: str
    build: Callable[[Graph, str, int], str | Sequence[str]]
    note: str = ""
    dtype: int = FLOAT


def _unary(op: str, dtype: int = FLOAT, **attributes: Any) -> Case:
    return Case(op, lambda g, x, w: g.node(op, [x], **attributes), _named(dtype), dtype)


def _named(dtype: int) -> str:
    return {FLOAT: "", INT32: "int32", INT64: "int64", BOOL: "bool"}[dtype]


def _binary(op: str, dtype: int = FLOAT, note: str = "", **attributes: Any) -> Case:
    kind = {FLOAT: np.float32, INT32: np.int32, INT64: np.int64, BOOL: np.bool_}[dtype]

    def build(g: Graph, x: str, w: int) -> str:
        values = np.random.default_rng(0).integers(1, 9, w) + (0.5 if dtype == FLOAT else 0)
        return str(g.node(op, [x, g.constant(values, kind)], **attributes))

    return Case(op, build, note or _named(dtype), dtype)


def _many(op: str, count: int) -> Case:
    def build(g: Graph, x: str, w: int) -> str:
        others = [g.constant(np.full(w, k)) for k in range(count - 1)]
        return str(g.node(op, [x, *others]))

    return Case(op, build, f"of {count}")


def _indices(g: Graph, x: str, top: int, dtype: int = INT64) -> str:
    """Computed integers from 0 to top, spread evenly."""
    wild = g.node("Mul", [x, g.constant(7919.0)])
    whole = g.node("Cast", [g.node("Clip", [wild, g.constant(-1e9), g.constant(1e9)])], to=dtype)
    kind = np.int64 if dtype == INT64 else np.int32
    return str(g.node("Mod", [whole, g.constant([top], kind)]))


def _table(entries: int, columns: int) -> Case:
    def build(g: Graph, x: str, w: int) -> str:
        table = g.constant(np.random.default_rng(0).random((entries, columns)))
        found = g.node("Gather", [table, x])
        return str(g.node("Reshape", [found, g.constant([-1, w * columns], np.int64)]))

    return Case("Gather", build, f"table of {entries} x {columns}", -1 if entries < 1 << 11 else -2)


def cases() -> Iterator[Case]:
    for op in ("Abs", "Asin", "Atan", "Cos", "Exp", "Floor", "Log", "Neg", "Reciprocal", "Relu",
               "Sigmoid", "Sign", "Sin", "Sqrt"):  # fmt: skip
        yield _unary(op)
    for dtype in (INT32, INT64):
        for op in ("Abs", "Neg", "Sign"):
            yield _unary(op, dtype)
        for op in ("Add", "Mul", "Sub", "Div", "Mod", "Max", "Min", "Equal", "Less"):
            yield _binary(op, dtype)
    for op in ("Add", "Mul", "Sub", "Div", "Max", "Min", "Equal", "Greater", "GreaterOrEqual",
               "Less", "LessOrEqual"):  # fmt: skip
        yield _binary(op)
    yield _binary("Mod", note="fmod", fmod=1)
    yield from (_many("Max", 64), _many("Min", 8))
    yield from (_binary("And", BOOL), _binary("Or", BOOL), _unary("Not", BOOL))
    yield from (_unary("Cast", FLOAT, to=INT32), _unary("Cast", FLOAT, to=INT64))
    yield from (_unary("Cast", FLOAT, to=BOOL), _unary("Cast", INT64, to=FLOAT))
    yield Case("Clip", lambda g, x, w: g.node("Clip", [x, g.constant(-1.0), g.constant(1.0)]))
    yield Case("Where", lambda g, x, w: g.node("Where", [g.node("Less", [x, g.constant(0.0)]), x, g.constant(np.ones(w))]), "and Less")
    for op in ("ReduceSum", "ReduceMax"):
        yield Case(op, lambda g, x, w, op=op: g.node(op, [x, g.constant([1], np.int64)]), "a row")
        yield Case(op, lambda g, x, w, op=op: g.node(op, [g.node("Reshape", [x, g.constant([-1, 4, w // 4], np.int64)]), g.constant([1], np.int64)], keepdims=0), "first of two axes")
        yield Case(op, lambda g, x, w, op=op: g.node(op, [g.node("Reshape", [x, g.constant([-1, w // 4, 4], np.int64)]), g.constant([2], np.int64)], keepdims=0), "four numbers")
    for exclusive, reverse in ((0, 0), (1, 1)):
        yield Case("CumSum", lambda g, x, w, e=exclusive, r=reverse: g.node("CumSum", [x, g.constant(1, np.int64)], exclusive=e, reverse=r), "back" * reverse)
    yield Case("CumSum", lambda g, x, w: g.node("Reshape", [g.node("CumSum", [g.node("Reshape", [x, g.constant([-1, 4, w // 4], np.int64)]), g.constant(1, np.int64)]), g.constant([-1, w], np.int64)]), "first of two axes")
    yield Case("Softmax", lambda g, x, w: g.node("Softmax", [x], axis=1))
    yield Case("Softmax", lambda g, x, w: g.node("Reshape", [g.node("Softmax", [g.node("Reshape", [x, g.constant([-1, w // 4, 4], np.int64)])], axis=2), g.constant([-1, w], np.int64)]), "four numbers")
    yield Case("Softmax", lambda g, x, w: g.node("Reshape", [g.node("Softmax", [g.node("Reshape", [x, g.constant([-1, 4, w // 4], np.int64)])], axis=1), g.constant([-1, w], np.int64)]), "first of two axes")
    yield from (_table(1 << 10, 1), _table(1 << 10, 8), _table(1 << 21, 1), _table(1 << 21, 4))
    yield Case("Gather", lambda g, x, w: g.node("Gather", [x, g.constant(np.random.default_rng(0).permutation(w), np.int64)], axis=1), "columns")
    yield Case("GatherElements", lambda g, x, w: g.node("GatherElements", [x, _indices(g, x, w)], axis=1), "and its index")
    yield Case("Concat", lambda g, x, w: g.node("Concat", [x, x], axis=1))
    yield Case("Split", lambda g, x, w: g.node("Split", [x, g.constant([1] * w, np.int64)], w, axis=1), "single columns")
    yield Case("Slice", lambda g, x, w: g.node("Slice", [x, *(g.constant([v], np.int64) for v in (0, w, 1, 2))]), "every second")
    yield Case("Reshape", lambda g, x, w: g.node("Reshape", [g.node("Reshape", [x, g.constant([-1, 4, w // 4], np.int64)]), g.constant([-1, w], np.int64)]))
    yield Case("Transpose", lambda g, x, w: g.node("Reshape", [g.node("Transpose", [g.node("Reshape", [x, g.constant([-1, 8, w // 8], np.int64)])], perm=[0, 2, 1]), g.constant([-1, w], np.int64)]))
    yield Case("Squeeze", lambda g, x, w: g.node("Squeeze", [g.node("Unsqueeze", [x, g.constant([1], np.int64)]), g.constant([1], np.int64)]), "and Unsqueeze")
    yield Case("Identity", lambda g, x, w: g.node("Identity", [x]))
    yield Case("Gemm", lambda g, x, w: g.node("Gemm", [x, g.constant(np.random.default_rng(0).random((w, w)) / w), g.constant(np.zeros(w))], transB=1))
    yield Case("MatMul", lambda g, x, w: g.node("MatMul", [x, g.constant(np.random.default_rng(0).random((w, w)) / w)]))
    yield Case("MatMul", lambda g, x, w: g.node("MatMul", [x, g.constant(np.random.default_rng(0).random((w, 1)) / w)]), "to one")


def build(case: Case | None, like: Case, width: int) -> bytes:
    """A network of COPIES of an operator, or the same without it."""
    g = Graph()
    wide = g.node("MatMul", ["position", g.constant(np.random.default_rng(1).normal(size=(3, COPIES * width)))])
    parts = g.node("Split", [wide, g.constant([width] * COPIES, np.int64)], COPIES, axis=1)
    sums = []
    for part in parts:
        x = part
        if like.dtype in (-1, -2):
            x = _indices(g, x, 1 << 10 if like.dtype == -1 else 1 << 21, INT64)
        elif like.dtype != FLOAT:
            x = g.node("Cast", [x], to=like.dtype)
        found = x if case is None else case.build(g, x, width)
        for value in [found] if isinstance(found, str) else found[:1]:
            sums.append(g.node("ReduceMax", [g.node("Cast", [value], to=FLOAT), g.constant([1], np.int64)]))
    joined = g.node("Concat", sums, axis=1)
    return g.model(str(g.node("MatMul", [joined, g.constant(np.ones((len(sums), 3)))])))


def feeds(rows: int, scale: float) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(2)
    return {n: (scale * rng.uniform(-1, 1, (rows, 3))).astype(np.float32) for n in NAMES}


def timer(evaluator: str, model: bytes, scale: float) -> Callable[[], Any]:
    """What evaluates a network once, on ROWS rows."""
    rows = feeds(ROWS[evaluator], scale)
    if evaluator == "NumPy":
        return lambda: reference.evaluate(model, rows, np.float32)
    if evaluator == "ONNX Runtime":
        from purelight_onnx.session import Session

        session = Session(model)
        return lambda: session(rows)
    import drjit as dr

    from purelight_mitsuba.fused import FusedNetwork
    from purelight_mitsuba.golden import lanes

    network, values = FusedNetwork(model), [lanes(a) for a in rows.values()]

    def run() -> None:
        dr.eval(*network(*values)[0].ravel())
        dr.sync_thread()

    return run


def paired(first: Callable[[], Any], second: Callable[[], Any]) -> tuple[float, float]:
    """Least seconds of both, taken in turn."""
    times: tuple[list[float], list[float]] = ([], [])
    for run in range(RUNS + 1):
        for function, own in zip((first, second), times, strict=True):
            start = time.perf_counter()
            function()
            if run:
                own.append(time.perf_counter() - start)
    return min(times[0]), min(times[1])


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.operator_cost", description=__doc__)
    parser.add_argument("--width", type=int, default=128)
    parser.add_argument("--only", nargs="+")
    options = parser.parse_args()
    use()
    import drjit as dr
    dr.set_thread_count(0)
    for case in cases():
        if options.only and case.op not in options.only:
            continue
        models = build(case, case, options.width), build(None, case, options.width)
        line = f"{case.op:<15}{case.note:<22}"
        for evaluator in ROWS:
            for scale in SCALES.values():
                try:
                    with_it, without = paired(*(timer(evaluator, m, scale) for m in models))
                    ns = (with_it - without) / (ROWS[evaluator] * COPIES * options.width) * 1e9
                    line += f"{ns:9.2f}"
                except Exception as e:
                    line += f" {type(e).__name__[:8]:>8}"
                    print(e, file=sys.stderr)
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
