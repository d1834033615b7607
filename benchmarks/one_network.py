"""A network of the profile under construction, `appearance` or `transparency`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from onnx import TensorProto, helper, numpy_helper

from purelight_format.networks.profile import IR_VERSION, OPSET
from purelight_format.networks.vectors import SIGNATURES

FLOAT, INT32, INT64, BOOL = (getattr(TensorProto, t) for t in ("FLOAT", "INT32", "INT64", "BOOL"))
DTYPES = {FLOAT: np.float32, INT32: np.int32, INT64: np.int64, BOOL: np.bool_}
INPUTS = SIGNATURES["appearance"].inputs


@dataclass
class Graph:
    """Nodes and constants, each given a name when it is added."""

    nodes: list[Any] = field(default_factory=list)
    constants: list[Any] = field(default_factory=list)

    def constant(self, value: Any, kind: int = FLOAT) -> str:
        """Adds an initializer."""
        name = f"c{len(self.constants)}"
        self.constants.append(numpy_helper.from_array(np.asarray(value, DTYPES[kind]), name))
        return name

    def several(self, op: str, inputs: Sequence[str], outputs: int, **attributes: Any) -> list[str]:
        """Adds a node; returns the names of its outputs."""
        names = [f"v{len(self.nodes)}_{k}" for k in range(outputs)]
        self.nodes.append(helper.make_node(op, list(inputs), names, **attributes))
        return names

    def node(self, op: str, *inputs: str, **attributes: Any) -> str:
        """Adds a node of one output."""
        return self.several(op, inputs, 1, **attributes)[0]

    def reshape(self, x: str, *sizes: int) -> str:
        return self.node("Reshape", x, self.constant([-1, *sizes], INT64))

    def wide(self, width: int) -> str:
        """A value of so many columns, each another mixture of the position."""
        weight = np.random.default_rng(1).normal(size=(3, width))
        return self.node("MatMul", "position", self.constant(weight))

    def indices(self, x: str, top: int) -> str:
        """Computed integers from 0 to top, spread evenly."""
        wild = self.node("Mul", x, self.constant(7919.0))
        tame = self.node("Clip", wild, self.constant(-1e9), self.constant(1e9))
        whole = self.node("Cast", tame, to=INT64)
        return self.node("Mod", whole, self.constant([top], INT64))

    def model(self, x: str, width: int, network: str = "appearance") -> bytes:
        """The network whose output is the mean of the columns of x, three times."""
        mean = self.node("MatMul", x, self.constant(np.full((width, 3), 1 / width)))
        (name,) = SIGNATURES[network].outputs
        self.nodes.append(helper.make_node("Identity", [mean], [name]))
        tensors = INPUTS | {name: (3,)}
        infos = {
            name: helper.make_tensor_value_info(name, FLOAT, ["N", *shape])
            for name, shape in tensors.items()
        }
        output = infos.pop(name)
        graph = helper.make_graph(self.nodes, "g", list(infos.values()), [output], self.constants)
        opsets = [helper.make_opsetid("", OPSET)]
        made = helper.make_model(graph, opset_imports=opsets, ir_version=IR_VERSION)
        data: bytes = made.SerializeToString()
        return data


# What several benchmarks put into a network: a value, and how many columns it has

Body = Callable[[Graph], tuple[str, int]]


def repeated(op: str, width: int, count: int) -> Body:
    """An operator of one operand, again and again."""

    def body(g: Graph) -> tuple[str, int]:
        x = g.wide(width)
        for _ in range(count):
            x = g.node(op, x)
        return x, width

    return body


def layers(width: int, count: int) -> Body:
    """Dense layers that share one weight."""

    def body(g: Graph) -> tuple[str, int]:
        x = g.wide(width)
        weight = g.constant(np.random.default_rng(0).normal(size=(width, width)) / width**0.5)
        bias = g.constant(np.zeros(width))
        for _ in range(count):
            x = g.node("Gemm", x, weight, bias, transB=1)
        return x, width

    return body


def rows(count: int, scale: float = 2.0) -> dict[str, np.ndarray]:
    """Inputs between -scale and scale."""
    rng = np.random.default_rng(2)
    return {
        name: (scale * rng.uniform(-1, 1, (count, *shape))).astype(np.float32)
        for name, shape in INPUTS.items()
    }
