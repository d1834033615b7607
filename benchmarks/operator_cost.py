"""What one element of each operator takes, by each evaluator, against what the profile states.

python -m benchmarks.operator_cost [--width 128] [--only Sin Mod]

A network of several copies of an operator is timed beside the same network without it, on one
thread, with ordinary numbers and with huge ones. Figures are nanoseconds for each element that the
operator writes; the last column is the longest of them over the stated cost, at most 5.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.one_network import BOOL, FLOAT, INT32, INT64, Graph, rows
from purelight_format import command
from purelight_format.networks import reference
from purelight_format.networks.profile import inspect
from purelight_mitsuba.platform import use

COPIES, RUNS, BAR = 8, 4, 5.0
ROWS = {"NumPy": 256, "ONNX Runtime": 1024, "Dr.Jit": 1 << 13}
SCALES = (2.0, 1e30)
NAMED = {FLOAT: "", INT32: "int32", INT64: "int64", BOOL: "bool"}
UNARY = ("Abs Asin Atan Cos Exp Floor Identity Log Neg Reciprocal Relu Sigmoid Sign Sin Softmax "
         "Sqrt")  # fmt: skip
BINARY = "Add Div Equal Greater GreaterOrEqual Less LessOrEqual Max Min Mul Sub"
INTEGER = "Add Div Equal Less Max Min Mod Mul Sub"

Build = Callable[[Graph, str, int], str]


@dataclass(frozen=True)
class Case:
    """One use of an operator.

    Arguments:
        build: adds it behind a value [N, width].
        note: what is special.
        kind: element type of that value.
        table: size of the table for which that value holds indices, which is the first constant.
    """

    op: str
    build: Build
    note: str = ""
    kind: int = FLOAT
    table: tuple[int, int] | None = None


# The uses


def unary(op: str, kind: int = FLOAT, **attributes: Any) -> Case:
    return Case(op, lambda g, x, w: g.node(op, x, **attributes), NAMED[kind], kind)


def binary(op: str, kind: int = FLOAT, count: int = 2, **attributes: Any) -> Case:
    def build(g: Graph, x: str, w: int) -> str:
        values = np.random.default_rng(0).integers(1, 9, w) + (0.5 if kind == FLOAT else 0)
        others = [g.constant(values + k, kind) for k in range(count - 1)]
        return g.node(op, x, *others, **attributes)

    return Case(op, build, f"{NAMED[kind]}{count if count > 2 else ''}", kind)


def folded(op: str, axis: int, sizes: Callable[[int], tuple[int, ...]], note: str) -> Case:
    """An operator along an axis of a row of two axes, or of the whole row."""

    def build(g: Graph, x: str, w: int) -> str:
        shaped = g.reshape(x, *sizes(w))
        if op == "Softmax":
            found = g.node(op, shaped, axis=axis)
        else:
            axes: Any = axis if op == "CumSum" else [axis]
            found = g.node(op, shaped, g.constant(axes, INT64))
        return g.reshape(found, w if op in ("CumSum", "Softmax") else w // sizes(w)[axis - 1])

    return Case(op, build, note)


def table(entries: int, columns: int) -> Case:
    def build(g: Graph, x: str, w: int) -> str:
        count = w // (2 * columns)
        index = g.node("Slice", x, *(g.constant([v], INT64) for v in (0, count, 1)))
        return g.reshape(g.node("Gather", g.constants[0].name, index), count * columns)

    return Case("Gather", build, f"{entries} x {columns}", INT64, (entries, columns))


def layer(op: str) -> Case:
    def build(g: Graph, x: str, w: int) -> str:
        weight = g.constant(np.random.default_rng(0).random((w, w)) / w)
        if op == "MatMul":
            return g.node(op, x, weight)
        return g.node(op, x, weight, g.constant(np.zeros(w)), transB=1)

    return Case(op, build)


def single_columns(g: Graph, x: str, w: int) -> str:
    return g.several("Split", [x, g.constant([1] * w, INT64)], w, axis=1)[0]


def every_second(g: Graph, x: str, w: int) -> str:
    return g.node("Slice", x, *(g.constant([v], INT64) for v in (0, w, 1, 2)))


def transposed(g: Graph, x: str, w: int) -> str:
    return g.reshape(g.node("Transpose", g.reshape(x, 8, w // 8), perm=[0, 2, 1]), w)


def columns(g: Graph, x: str, w: int) -> str:
    order = np.random.default_rng(0).permutation(w)
    return g.node("Gather", x, g.constant(order, INT64), axis=1)


def squeezed(g: Graph, x: str, w: int) -> str:
    one = g.constant([1], INT64)
    return g.node("Squeeze", g.node("Unsqueeze", x, one), one)


def chosen(g: Graph, x: str, w: int) -> str:
    positive = g.node("Greater", x, g.constant(0.0))
    return g.node("Where", positive, x, g.constant(np.ones(w)))


def cases() -> Iterator[Case]:
    """Every operator of the profile, some in several ways."""
    yield from (unary(op) for op in UNARY.split())
    yield from (unary(op, kind) for kind in (INT32, INT64) for op in ("Abs", "Neg", "Sign"))
    yield from (binary(op) for op in BINARY.split())
    yield from (binary(op, kind) for kind in (INT32, INT64) for op in INTEGER.split())
    yield from (binary("Mod", fmod=1), binary("Max", count=64), binary("Min", count=8))
    yield from (binary("And", BOOL), binary("Or", BOOL), unary("Not", BOOL))
    yield from (unary("Cast", to=kind) for kind in (INT32, INT64, BOOL))
    yield unary("Cast", INT64, to=FLOAT)
    yield Case("Clip", lambda g, x, w: g.node("Clip", x, g.constant(-1.0), g.constant(1.0)))
    yield Case("Where", chosen, "and Greater")
    for op in ("ReduceSum", "ReduceMax", "CumSum", "Softmax"):
        yield folded(op, 1, lambda w: (w,), "the row")
        yield folded(op, 1, lambda w: (4, w // 4), "first of two axes")
        yield folded(op, 2, lambda w: (w // 4, 4), "fours")
    yield from (table(1 << 10, 1), table(1 << 10, 8), table(1 << 21, 1), table(1 << 21, 4))
    yield Case("Gather", columns, "columns")
    yield Case(
        "GatherElements",
        lambda g, x, w: g.node("GatherElements", x, g.indices(x, w), axis=1),
        "and its index",
    )
    yield Case("Concat", lambda g, x, w: g.node("Concat", x, x, axis=1))
    yield Case("Split", single_columns, "single columns")
    yield Case("Slice", every_second, "every second")
    yield Case("Reshape", lambda g, x, w: g.reshape(g.reshape(x, 4, w // 4), w))
    yield Case("Transpose", transposed)
    yield Case("Squeeze", squeezed, "and Unsqueeze")
    yield from (layer("Gemm"), layer("MatMul"))


# The networks, and their times


def network(case: Case, width: int, *, without: bool = False) -> bytes:
    """COPIES of an operator side by side, or the same network without it."""
    g = Graph()
    if case.table:  # Reading it from the file is no part of the operator.
        g.constant(np.random.default_rng(0).random(case.table))
    parts = g.several(
        "Split", [g.wide(COPIES * width), g.constant([width] * COPIES, INT64)], COPIES, axis=1
    )
    ends = []
    for part in parts:
        x = g.indices(part, case.table[0]) if case.table else part
        if case.kind != FLOAT and not case.table:
            x = g.node("Cast", x, to=case.kind)
        found = x if without else case.build(g, x, width)
        ends.append(g.node("ReduceMax", g.node("Cast", found, to=FLOAT), g.constant([1], INT64)))
    return g.model(g.node("Concat", *ends, axis=1), COPIES)


def evaluation(evaluator: str, model: bytes, scale: float) -> Callable[[], Any]:
    """What evaluates a network once."""
    inputs = rows(ROWS[evaluator], scale)
    if evaluator == "NumPy":
        return lambda: reference.evaluate(model, inputs, np.float32)
    if evaluator == "ONNX Runtime":
        from purelight_onnx.session import Session

        session = Session(model)
        return lambda: session(inputs)
    import drjit as dr

    from purelight_mitsuba.translate.golden import lanes
    from purelight_mitsuba.translate.network import FusedNetwork

    fused, values = FusedNetwork(model), [lanes(array) for array in inputs.values()]

    def run() -> None:
        dr.eval(*fused(*values)[0].ravel())
        dr.sync_thread()

    return run


def difference(evaluator: str, models: tuple[bytes, bytes], scale: float) -> float:
    """Nanoseconds a row of the first network beyond the second; both are timed in turn."""
    runs = [evaluation(evaluator, model, scale) for model in models]
    times: list[list[float]] = [[], []]
    for turn in range(RUNS + 1):  # The first turn compiles.
        for run, own in zip(runs, times, strict=True):
            start = time.perf_counter()
            run()
            own += [time.perf_counter() - start] * bool(turn)
    return (min(times[0]) - min(times[1])) / ROWS[evaluator] * 1e9


def main() -> int:
    """0 if no operator takes more than BAR times what is stated."""
    parser = command.Parser(prog="python -m benchmarks.operator_cost", description=__doc__)
    parser.add_argument("--width", type=command.whole(1), default=128)
    parser.add_argument("--only", nargs="+", metavar="OPERATOR")
    options = parser.parse_args()
    use()
    import drjit as dr

    dr.set_thread_count(0)
    print(f"{'operator':<34}{'stated':>8}" + "".join(f"{n:>14}" for n in ROWS) + f"{'ratio':>8}")
    worst = 0.0
    for case in cases():
        if options.only and case.op not in options.only:
            continue
        models = network(case, options.width), network(case, options.width, without=True)
        work = [inspect(model, "appearance").nanoseconds for model in models]
        stated, elements = work[0] - work[1], COPIES * options.width
        taken = {name: max(difference(name, models, s) for s in SCALES) for name in ROWS}
        ratio = max(taken.values()) / stated
        worst = max(worst, ratio)
        figures = "".join(f"{value / elements:14.2f}" for value in taken.values())
        name = f"{case.op} {case.note}"
        print(f"{name:<34}{stated / elements:8.2f}{figures}{ratio:8.2f}", flush=True)
    print(f"the longest is {worst:.1f} times what is stated, the bar is {BAR:.0f}")
    return int(worst > BAR)


if __name__ == "__main__":
    sys.exit(command.run("benchmarks.operator_cost", main))
