"""Every operator of the profile as compiled C++, against the reference evaluator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from onnx import TensorProto

from purelight_format.networks import reference
from purelight_format.networks.operators import OPERATORS
from purelight_format.networks.vectors import Signature
from purelight_shader.lowering.network import RULES
from tests.support.compiled import Batch, Network
from tests.unit.format import test_operators as known

node = known.node
F = np.float32
INTEGERS = [node("Mul", "x ten", "x10"), node("Cast", "x10", "i", to=TensorProto.INT32)]
WIDE = [node("Mul", "x ten", "x10"), node("Cast", "x10", "i", to=TensorProto.INT64)]
CONSTANTS: dict[str, Any] = {
    "threes": np.array([3, 5, 7, 4]), "threes32": np.array([3, 5, 7, 4], np.int32),
    "vast": np.array([2**40 + 1]), "vast32": np.array([2**31 - 1], np.int32),
    "bits": np.array([True, False, True, True]), "wide": F(np.arange(4 * 70).reshape(70, 4) / 99),
    "bias70": F(np.arange(70) / 7), "whole": np.array([[1, 2**30], [3, -4]]),
    "two_d": np.array([[0, 2], [3, 1]]), "deep": F(np.arange(24).reshape(2, 3, 4)),
    "axes12": np.array([1, 2]), "axis2": np.array(2), "shape22": np.array([-1, 2, 2]),
    "flat4": np.array([-1, 4]), "one64": np.array([1]), "half": F([0.5]), "zero": F([0]),
    "eights": F(np.arange(16).reshape(2, 8)), "lots": F([1e5]), "sizes4": np.array([1, 1, 1, 1]),
    "from0": np.array([0]), "to3": np.array([3]), "two64": np.array([2]), "axes1": np.array([1]),
    "same": F([2, 2, 2, 2]), "hundred": np.array([100]),
}  # fmt: skip
MATRIX = [node("Reshape", "x shape22", "m"), node("Reshape", "y shape22", "n")]
FLAGS = [node("Greater", "x y", "p")]
MORE: dict[str, known.Case] = {
    "integers, each divided by its own": ([*INTEGERS, node("Mod", "i threes32")], (4,)),
    "64 bits, each divided by its own": ([*WIDE, node("Mod", "i threes")], (4,)),
    "quotients of negative integers": ([*INTEGERS, node("Div", "i threes32")], (4,)),
    "int32 wraps around": ([*INTEGERS, node("Mul", "i vast32", "v"), node("Add", "v vast32", "w2"),
                            node("Sub", "w2 i")], (4,)),
    "64 bits hold what 32 do not": (
        [*WIDE, node("Mul", "i vast", "v"), node("Mod", "v threes", "r")
         , node("Sub", "r one64")], (4,)),
    "signs of 64 bits": ([*WIDE, node("Mul", "i vast", "v"), node("Sign", "v")], (4,)),
    "signs of integers": ([*INTEGERS, node("Sign", "i")], (4,)),
    "sum of integers": ([*WIDE, node("ReduceSum", "i axes1")], (1,)),
    "sums of large integers": ([*WIDE, node("Mul", "i vast", "v"), node("CumSum", "v axis1", "c"),
                                node("Mod", "c threes")], (4,)),
    "largest of integers": ([*INTEGERS, node("ReduceMax", "i axes1", keepdims=0)], ()),
    "many outputs": ([node("Gemm", "x wide bias70", transB=1)], (70,)),
    "many outputs of several pieces": (
        [node("Add", "x y", "s"), node("Slice", "s from0 two64 axes1", "a"),
         node("Slice", "y two64 hundred axes1", "b"), node("Concat", "a b", "c", axis=1),
         node("Gemm", "c wide bias70", transB=1)], (70,)),
    "sum of two axes": ([*MATRIX, node("ReduceSum", "m axes12")], (1, 1)),
    "sum of the inner axis": ([*MATRIX, node("ReduceSum", "m axes12", "t"),
                               node("CumSum", "m axis2", reverse=1)], (2, 2)),
    "sums along the outer axis": ([*MATRIX, node("CumSum", "m axis1", exclusive=1)], (2, 2)),
    "softmax of the outer axis": ([*MATRIX, node("Softmax", "m", axis=1)], (2, 2)),
    "transposed products": (
        [*MATRIX, node("Transpose", "m", "t", perm=[0, 2, 1]), node("Mul", "t n")], (2, 2)),
    "transposed, then flat": (
        [*MATRIX, node("Transpose", "m", "t", perm=[0, 2, 1]), node("Reshape", "t flat4")], (4,)),
    "columns in two axes": ([node("Gather", "x two_d", axis=1)], (2, 2)),
    "columns of the inner axis": ([*MATRIX, node("Gather", "m one64", axis=2)], (2, 1)),
    "rows of three axes": ([*WIDE, node("Mod", "i two64", "j"), node("Gather", "deep j")],
                           (4, 3, 4)),
    "rows of eight": ([*WIDE, node("Mod", "i two64", "j"), node("Gather", "eights j")], (4, 8)),
    "rows of integers": ([*WIDE, node("Mod", "i two64", "j"), node("Gather", "whole j")], (4, 2)),
    "truth values of a table": (
        [*WIDE, node("Mod", "i threes", "j"), node("Mod", "j one64", "k"),
         node("Gather", "bits k")], (4,)),
    "elements from behind": ([*WIDE, node("Mod", "i threes", "j"), node("Mod", "j two64", "k"),
                              node("Neg", "k", "l"), node("GatherElements", "x l", axis=1)], (4,)),
    "elements of the inner axis": (
        [*MATRIX, *WIDE, node("Mod", "i two64", "j"), node("Reshape", "j shape22", "l"),
         node("GatherElements", "m l", axis=2)], (2, 2)),
    "concatenation of alike": ([node("Concat", "x x x", "c", axis=1),
                                node("Mul", "c c")], (12,)),
    "pieces put together anew": (
        [node("Split", "x sizes4", "a b c d", axis=1), node("Concat", "d c b a", "e", axis=1),
         node("Add", "e x")], (4,)),
    "pieces of two axes": (
        [*MATRIX, node("Concat", "m n", "c", axis=1), node("Concat", "m n", "d", axis=2),
         node("Slice", "c from0 two64 axes1", "e"), node("Slice", "d from0 two64 two64", "g"),
         node("Mul", "e g")], (2, 2)),
    "large angles": ([node("Mul", "x lots", "l"), node("Sin", "l")], (4,)),
    "cosines of large angles": ([node("Mul", "x lots", "l"), node("Cos", "l")], (4,)),
    "steep angles": ([node("Mul", "x lots", "l"), node("Atan", "l")], (4,)),
    "a constant condition": ([node("Where", "bits x y")], (4,)),
    "an equal condition": ([*FLAGS, node("Greater", "y x", "q"), node("Equal", "p q")], (4,)),
    "equal constants": ([node("Mul", "x same")], (4,)),
    "truth values to integers and back": (
        [*FLAGS, node("Cast", "p", "i", to=TensorProto.INT64),
         node("Cast", "i", to=TensorProto.BOOL)], (4,)),
    "64 bits to 32": ([*WIDE, node("Cast", "i", to=TensorProto.INT32)], (4,)),
    "clipped integers": ([*WIDE, node("Clip", "i none0 three0")], (4,)),
    "a long chain": (
        [node("Add", "x y", "a0"), *(node("Sin", f"a{k}", f"a{k + 1}") for k in range(90)),
         node("Mul", "a90 a90")], (4,)),
}  # fmt: skip
CONSTANTS |= {"none0": np.array(0), "three0": np.array(3)}
CASES = known.CASES | MORE
LOOSE = {"large angles": 2e-2, "cosines of large angles": 2e-2}
EXACT = 2e-6


def networks(monkeypatch: pytest.MonkeyPatch) -> dict[str, Network]:
    for name, value in CONSTANTS.items():
        monkeypatch.setitem(known.CONSTANTS, name, value)
    inputs = {"x": (4,), "y": (4,), "w": (1,)}
    return {
        name: Network(known.model(nodes, shape), Signature(inputs, {"result": shape}))
        for name, (nodes, shape) in CASES.items()
    }


@pytest.mark.parametrize("written", [0, 64])
def test_every_operator_equals_the_reference(
    written: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once with constants in buffers, once in the code."""
    made, feed = networks(monkeypatch), known.inputs(rows=9)
    rows = {name: list(feed.values()) for name in made}
    answers = Batch(made, written).answers(rows, tmp_path)
    wrong = {}
    for name, network in made.items():
        expected = reference.evaluate(network.model, feed, np.float32)["result"].reshape(9, -1)
        tolerance = LOOSE.get(name, EXACT)
        if not np.allclose(answers[name], expected, rtol=tolerance, atol=tolerance):
            wrong[name] = answers[name][0], expected[0]
    assert wrong == {}


def test_every_operator_has_a_rule_and_a_case() -> None:
    tested = {made.op_type for nodes, _ in CASES.values() for made in nodes}
    assert set(RULES) == set(OPERATORS) == tested


def test_a_wrong_translation_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The remainder of the languages, which is not that of ONNX, would not pass."""
    made = {"Mod": networks(monkeypatch)["Mod of 32 bits"]}
    batch, feed = Batch(made), known.inputs(rows=9)
    text = batch.module.text.replace("return a < 0 ? b - 1 - rest : rest;", "return a % b;")
    assert text != batch.module.text
    object.__setattr__(batch.module, "text", text)
    answers = batch.answers({"Mod": list(feed.values())}, tmp_path)["Mod"]
    expected = reference.evaluate(made["Mod"].model, feed, np.float32)["result"]
    assert not np.allclose(answers, expected)


def test_what_vast_numbers_leave_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sine stays within one and a remainder below its divisor, where no digit can be right."""
    monkeypatch.setitem(CONSTANTS, "vast_float", F([1e9]))
    monkeypatch.setitem(CONSTANTS, "vaster", F([1e36]))
    for name in ("vast_float", "vaster"):
        for last in (node("Sin", "v"), node("Cos", "v"), node("Mod", "v same", fmod=1)):
            case = [node("Mul", f"x {name}", "v"), last], (4,)
            monkeypatch.setitem(CASES, f"{last.op_type} of {name}", case)
    made = {k: v for k, v in networks(monkeypatch).items() if " of vast" in k}
    feed = known.inputs(rows=9)
    answers = Batch(made).answers({name: list(feed.values()) for name in made}, tmp_path)
    assert len(answers) == 6
    for name, found in answers.items():
        assert (np.abs(found) <= (2 if "Mod" in name else 1.0001)).all(), (name, found)
