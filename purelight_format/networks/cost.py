"""What a node costs: nanoseconds a row on one core, by the slowest of the evaluators we ship.

That is the reference evaluator, NumPy on rows of golden vectors, for nearly all operators. The
figures are rounded from `python -m benchmarks.operator_cost`, which also shows by how much each
evaluator differs from them; what an operator reads counts as much as what it writes.
"""

from __future__ import annotations

from purelight_format.networks.operators import FLOAT, INDEX, Node, Tensor

# Of a node, and of each of its operands and results: Python's part of the work on 64 rows.
CALL, NAME = 100.0, 20.0

PRODUCT = 0.1  # Of a multiply-add in float32.

ELEMENT = {
    # What only moves elements, or nothing at all.
    **dict.fromkeys(("Concat", "Identity", "Reshape", "Slice", "Split", "Squeeze", "Transpose",
                     "Unsqueeze"), 1.0),
    # One instruction each, and the traffic with the cache.
    **dict.fromkeys(("Abs", "Add", "And", "Cast", "Clip", "Div", "Equal", "Floor", "Greater",
                     "GreaterOrEqual", "Less", "LessOrEqual", "Max", "Min", "Mul", "Neg", "Not",
                     "Or", "Reciprocal", "Relu", "Sign", "Sqrt", "Sub", "Where"), 2.0),
    # Polynomials; a sine or cosine of a large number is reduced in higher precision first.
    **dict.fromkeys(("Exp", "Log"), 4.0),
    "Sigmoid": 8.0,  # Four passes in the reference evaluator.
    **dict.fromkeys(("Asin", "Atan", "Cos", "Sin"), 15.0),
    # Short axes are not vectorised.
    **dict.fromkeys(("CumSum", "ReduceMax", "ReduceSum"), 8.0),
    "Softmax": 20.0,
    **dict.fromkeys(("Gather", "GatherElements"), 10.0),
}  # fmt: skip
INTEGER_DIVISION = 15.0  # Five passes in the reference evaluator.
LARGE_TABLE, DISTANT = 1 << 18, 25.0  # Elements; entries of larger ones are not in the cache.
FLOAT_REMAINDER = 100.0  # A division bit by bit where the quotient is large.

FOLDING = ("CumSum", "ReduceMax", "ReduceSum", "Softmax")
COMBINING = ("Max", "Min")


def nanoseconds(node: Node, outputs: list[Tensor]) -> float:
    """Work of a node for one row."""
    names = len(node.inputs) + len(outputs)
    return CALL + NAME * names + products(node) * PRODUCT + _rate(node) * _elements(node, outputs)


def products(node: Node) -> int:
    """Multiply-adds of a matrix product for one row: one for each weight."""
    if node.op not in ("Gemm", "MatMul"):
        return 0
    return node.constant(1, (FLOAT,)).size


def _rate(node: Node) -> float:
    first = node.inputs[0]
    if node.op == "Mod" and node.attributes.get("fmod", 0):
        return FLOAT_REMAINDER
    if node.op == "Mod" or (node.op == "Div" and first is not None and first.dtype in INDEX):
        return INTEGER_DIVISION
    if node.op == "Gather" and first is not None and first.value is not None:
        return DISTANT if first.size > LARGE_TABLE else ELEMENT[node.op]
    return ELEMENT.get(node.op, 0.0)


def _elements(node: Node, outputs: list[Tensor]) -> int:
    """How often a node does its work for one row."""
    written = sum(tensor.size for tensor in outputs)
    if node.op in COMBINING:
        return max(1, len(node.inputs) - 1) * written
    if node.op in FOLDING:
        return node.rows().size
    return written
