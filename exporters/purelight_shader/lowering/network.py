"""A vetted network as a program of the intermediate form."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.networks.model import load
from purelight_format.networks.operators import FLOAT, Tensor
from purelight_format.networks.profile import foretell
from purelight_format.networks.vectors import Signature
from purelight_shader.form.elements import Array, Kind
from purelight_shader.form.statements import Port, Program
from purelight_shader.form.store import Store
from purelight_shader.lowering import arrangement, elementwise, lookup, products, reads, sums
from purelight_shader.lowering.bounds import Bounds
from purelight_shader.lowering.given import Given, Rule
from purelight_shader.lowering.value import Value
from purelight_shader.lowering.writer import Writer, load_all

RULES: dict[str, Rule] = {
    **elementwise.RULES,
    **arrangement.RULES,
    **lookup.RULES,
    **sums.RULES,
    **products.RULES,
}
Limits = Mapping[str, tuple[np.ndarray, np.ndarray]]


def lower(
    model: bytes, network: str, signature: Signature, limits: Limits, store: Store
) -> Program:
    """Translates a network.

    Arguments:
        model: ONNX bytes that `profile.inspect` has accepted.
        network: its kind, for messages.
        signature: its inputs and outputs.
        limits: least and largest that each input may be, shaped as one sample.
        store: takes the constants.

    Raises:
        PureLightError: If an operator has no translation.
    """
    graph = load(model).graph
    tensors, _ = foretell(graph, signature.inputs)
    writer = Writer(store, reads.count(graph, tensors))
    inputs = tuple(
        Port(name, shape, Array(f"x{k}", Kind.FLOAT, prod(shape)))
        for k, (name, shape) in enumerate(signature.inputs.items())
    )
    values = {
        port.name: Value.whole(
            FLOAT, port.shape, load_all(port.array, port.shape), Bounds(*limits[port.name])
        )
        for port in inputs
    }
    for node in graph.node:
        _lower(writer, node, tensors, values, network)
    outputs = tuple(
        _output(writer, k, name, values[name]) for k, name in enumerate(signature.outputs)
    )
    return Program(network, inputs, outputs, tuple(writer.statements))


def _lower(
    writer: Writer, node: Any, tensors: Mapping[str, Tensor], values: dict[str, Value], where: str
) -> None:
    if node.op_type not in RULES:
        raise PureLightError(f"{where}: the operator {node.op_type} has no translation")
    given = Given(
        node.op_type,
        tuple(values.get(name) for name in node.input),
        tuple(tensors[name].value if name else None for name in node.input),
        {a.name: _attribute(a) for a in node.attribute},
        tuple(tensors[name] for name in node.output),
    )
    made = RULES[node.op_type](writer, given)
    for name, result in zip(node.output, made, strict=True):
        values[name] = writer.settled(name, result)


def _attribute(attribute: Any) -> Any:
    return {1: attribute.f, 2: attribute.i, 7: list(attribute.ints)}[attribute.type]


def _output(writer: Writer, index: int, name: str, result: Value) -> Port:
    array = Array(f"y{index}", Kind.FLOAT, prod(result.shape))
    writer.write(array, result)
    return Port(name, result.shape, array)
