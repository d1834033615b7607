"""Networks with damage in their bytes and in their graphs: refused, or as cheap as stated."""

from __future__ import annotations

from typing import Any

import numpy as np
import onnx
import onnxruntime
from google.protobuf.descriptor import FieldDescriptor

from purelight_format import reference
from purelight_format.errors import PureLightError
from purelight_format.issues import FormatError
from purelight_format.limits import LIMITS
from purelight_format.onnx_operators import OPERATORS
from purelight_format.onnx_profile import NetworkCost, inspect
from purelight_format.vectors import SIGNATURES
from tests.assets import lamp
from tests.assets.mutation import mutate, rounds

ROWS = 3


def vetted(data: bytes, network: str) -> NetworkCost | None:
    try:
        return inspect(data, network)
    except FormatError as error:
        if error.issue.code.name.startswith("PLX_ONNX_"):
            return None
        raise


def require_stated_cost(data: bytes, network: str, cost: NetworkCost) -> None:
    """Every intermediate has exactly the elements per row that the walk foretold."""
    assert cost.floats_per_sample <= LIMITS.sample_floats_sum
    inputs, outputs = SIGNATURES[network]
    feed = {name: np.full((ROWS, *shape), 0.3, np.float32) for name, shape in inputs.items()}
    proto = onnx.load_from_string(data)
    measured = 0
    del proto.graph.output[:]
    names = [name for node in proto.graph.node for name in node.output]
    proto.graph.output.extend(onnx.ValueInfoProto(name=name) for name in names)
    try:
        results = reference.evaluate(proto.SerializeToString(), feed, np.float32)
    except PureLightError:
        return  # A computed index beyond its table stops the evaluation.
    measured = sum(value.size for value in results.values())
    assert measured == ROWS * cost.floats_per_sample
    assert all(results[name].shape == (ROWS, *shape) for name, shape in outputs.items())


def require_a_runtime(data: bytes, network: str) -> None:
    """ONNX Runtime takes what we accept, and gives the promised shapes."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 4
    session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    inputs, outputs = SIGNATURES[network]
    feed = {name: np.full((ROWS, *shape), 0.3, np.float32) for name, shape in inputs.items()}
    try:
        results = session.run(list(outputs), feed)
    except onnxruntime.capi.onnxruntime_pybind11_state.InvalidArgument:
        return  # The same index.
    for result, shape in zip(results, outputs.values(), strict=True):
        assert result.shape == (ROWS, *shape)


@rounds(4_000, 400_000)
def test_damaged_bytes_are_refused_or_cheap(rounds: int) -> None:
    rng = np.random.default_rng(31)
    models = {name: make().SerializeToString() for name, make in lamp.NETWORKS.items()}
    small = [name for name in models if len(models[name]) < 5000]
    accepted = 0
    for k in range(rounds):
        network = small[k % len(small)]
        data = mutate(models[network], rng, (b"Loop", b"\xff" * 9, b"com.microsoft"))
        cost = vetted(data, network)
        if cost is not None:
            accepted += 1
            require_stated_cost(data, network, cost)
    assert 0 < accepted < rounds


@rounds(3_000, 300_000)
def test_damaged_graphs_are_refused_or_run(rounds: int) -> None:
    rng = np.random.default_rng(32)
    networks = ["appearance", "transparency", "sampler", "sampler_pdf"]
    good = {name: lamp.NETWORKS[name]() for name in networks}
    accepted = 0
    for k in range(rounds):
        network = networks[k % 4]
        proto = onnx.ModelProto()
        proto.CopyFrom(good[network])
        for _ in range(int(rng.integers(1, 3))):
            _damage(proto.graph, rng)
        data = proto.SerializeToString()
        cost = vetted(data, network)
        if cost is not None:
            accepted += 1
            require_stated_cost(data, network, cost)
            require_a_runtime(data, network)
    assert 0 < accepted < rounds


def _damage(graph: Any, rng: np.random.Generator) -> None:
    """Changes one thing of a graph that still parses."""
    names = [n for node in graph.node for n in (*node.input, *node.output)] + ["", "nothing"]
    node = graph.node[int(rng.integers(len(graph.node)))]
    tensor = graph.initializer[int(rng.integers(len(graph.initializer)))]
    match int(rng.integers(8)):
        case 0:
            node.op_type = str(rng.choice([*OPERATORS, "Loop", "Expand"]))
        case 1 if node.input:
            node.input[int(rng.integers(len(node.input)))] = str(rng.choice(names))
        case 2:
            node.input.append(str(rng.choice(names)))
        case 3 if tensor.dims:
            tensor.dims[int(rng.integers(len(tensor.dims)))] = int(rng.choice([0, 1, 3, 8, 2**40]))
        case 4:
            tensor.raw_data = mutate(tensor.raw_data, rng)
        case 5 if node.attribute:
            node.attribute[0].i = int(rng.choice([-2, -1, 0, 1, 2, 2**62]))
        case 6:
            graph.node.insert(int(rng.integers(len(graph.node))), _new_node(graph, rng, names))
        case _:
            _change_some_field(node if rng.random() < 0.5 else tensor, rng)


def _new_node(graph: Any, rng: np.random.Generator, names: list[str]) -> Any:
    """An operator of the profile on values of the graph, which may well fit."""
    op = str(rng.choice(list(OPERATORS)))
    inputs = [str(rng.choice(names)) for _ in range(OPERATORS[op].least)]
    node = onnx.helper.make_node(op, inputs, [f"new{len(graph.node)}"])
    for name in OPERATORS[op].attributes:
        node.attribute.add(name=name, type=onnx.AttributeProto.INT, i=int(rng.integers(-1, 3)))
    return node


def _change_some_field(message: Any, rng: np.random.Generator) -> None:
    """Sets a scalar field of a protobuf message to a value that it seldom has."""
    fields = [f for f in message.DESCRIPTOR.fields if f.cpp_type != FieldDescriptor.CPPTYPE_MESSAGE]
    field = fields[int(rng.integers(len(fields)))]
    kinds = {
        FieldDescriptor.CPPTYPE_STRING: "text" if field.type == field.TYPE_STRING else b"bytes",
        FieldDescriptor.CPPTYPE_FLOAT: 1.5,
        FieldDescriptor.CPPTYPE_DOUBLE: 1.5,
    }
    value = kinds.get(field.cpp_type, 1)
    if field.is_repeated:
        getattr(message, field.name).append(value)
    else:
        setattr(message, field.name, value)
