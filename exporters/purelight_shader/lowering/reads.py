"""How many elements of each value are read: what is read once need not be written down."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from math import prod
from typing import Any

from purelight_format.networks.operators import Tensor

MOVING = ("Identity", "Reshape", "Slice", "Split", "Squeeze", "Transpose", "Unsqueeze")
FOLDING = ("CumSum", "Gemm", "MatMul", "ReduceMax", "ReduceSum", "Softmax")


def count(graph: Any, values: Mapping[str, Tensor]) -> dict[str, float]:
    """Reads by name, if every value is written down that is read more often than it has elements.

    Arguments:
        graph: a GraphProto of the profile.
        values: types and shapes by name.
    """
    reads: defaultdict[str, float] = defaultdict(float)
    for output in graph.output:
        reads[output.name] += prod(values[output.name].shape)
    for node in reversed(graph.node):
        for name, number in _of(node, values, reads):
            reads[name] += number
    return reads


def _of(node: Any, values: Mapping[str, Tensor], reads: Mapping[str, float]) -> Any:
    sizes = {name: prod(values[name].shape) for name in (*node.input, *node.output) if name}
    given, made = [name for name in node.input if name], node.output[0]
    if node.op_type in MOVING:
        return [(given[0], sum(reads[name] for name in node.output))]
    if node.op_type == "Concat":
        often = reads[made] / sizes[made]
        return [(name, often * sizes[name]) for name in given]
    if node.op_type in FOLDING:
        return [(given[0], sizes[given[0]])]
    if node.op_type == "Gather" and values[given[1]].value is None:
        return [(given[1], sizes[given[1]])]
    number = min(reads[made], sizes[made])
    return [(name, number) for name in given]
