"""How long Dr.Jit compiles a network, in which each column of each intermediate is a variable."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import onnx

from purelight_format.errors import PureLightError
from purelight_format.networks.operators import Tensor
from purelight_format.networks.profile import foretell
from purelight_format.networks.vectors import SIGNATURES
from purelight_mitsuba.translate.network import LITERAL_INPUTS

# Seconds of one network; a kernel has a few. Those of the paper take 19, but its fast map 53, which
# ONNX Runtime evaluates sooner (`answers.LARGEST_COMPILED`).
ELEMENTS, LAYERS = 10.0, 20.0
PRODUCTS = ("Gemm", "MatMul")

# Milliseconds of one element, measured with LLVM on one core (`benchmarks.compile_cost`).
ELEMENT = {
    **dict.fromkeys(("Asin", "Atan", "Exp", "Sigmoid", "Softmax"), 3.5),
    **dict.fromkeys(("Cos", "Log", "Sin"), 6.0), "Mod": 12.0,
}  # fmt: skip
OTHER = 0.15
ENTRY, PACKED = 6.0, 8.0  # Of a table of one column, and of a column of those of several.
CHOICE = 0.6  # Of one column among which GatherElements chooses; all of them stay alive.

# Of a cooperative vector, for a weight, and for the square of the inputs, which all stay alive.
WEIGHT, CROWD = 0.012, 0.0003


def require_compilable(model: bytes, network: str, name: str) -> None:
    """Refuses a network of the profile that would keep the compiler busy for minutes.

    Arguments:
        network: A key of `SIGNATURES`.
        name: What to call the network in the error.

    Raises:
        PureLightError: If it is foretold to take more than `ELEMENTS` or `LAYERS`.
    """
    elements, layers = seconds(model, network)
    if elements > ELEMENTS or layers > LAYERS:
        raise PureLightError(
            f"{name}: Mitsuba would compile it for about {elements + layers:,.0f} seconds, which "
            "is too long; train a smaller network, or use a host that runs ONNX"
        )


def seconds(model: bytes, network: str) -> tuple[float, float]:
    """How long elementwise operators and dense layers of a network are foretold to compile."""
    graph = onnx.load_from_string(model).graph
    values, _ = foretell(graph, SIGNATURES[network].inputs)
    total = {False: 0.0, True: 0.0}
    for node in graph.node:
        total[node.op_type in PRODUCTS] += _milliseconds(node, values) / 1000
    return total[False], total[True]


def _milliseconds(node: Any, values: Mapping[str, Tensor]) -> float:
    inputs = [values[key] for key in node.input if key]
    written = sum(values[key].size for key in node.output)
    if node.op_type in PRODUCTS:
        return _layer(inputs[0].size, written)
    if node.op_type == "Gather" and inputs[0].value is not None:
        return (PACKED if written > inputs[1].size else ENTRY) * written
    if node.op_type == "GatherElements":
        return CHOICE * written * inputs[0].size
    if node.op_type in ("Max", "Min"):
        return OTHER * max(1, len(inputs) - 1) * written
    return ELEMENT.get(node.op_type, OTHER) * max(inputs[0].size, written)


def _layer(width: int, outputs: int) -> float:
    if width <= LITERAL_INPUTS:
        return OTHER * (width + 1) * outputs
    if dr.backend_v(mi.Float) == dr.JitBackend.CUDA:  # The driver has an instruction for it.
        return OTHER * (width + outputs)
    return OTHER * (width + outputs) + WEIGHT * width * outputs + CROWD * width**2
