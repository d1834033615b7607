"""Vetting of a network before any runtime sees it: from bytes, by our own walk over the graph.

ONNX's checker accepts graphs that allocate gigabytes or never end, and its shape inference can
be made to do so itself; here nothing is computed but shapes, and every operator has a bound.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from purelight_format import members
from purelight_format.issues import Issue, fail, issue
from purelight_format.limits import LIMITS, Limits
from purelight_format.networks.cost import nanoseconds, products
from purelight_format.networks.messages import BrokenMessageError
from purelight_format.networks.model import load
from purelight_format.networks.operators import FLOAT, OPERATORS, TYPES, Node, Shape, Tensor
from purelight_format.networks.vectors import SIGNATURES, Shapes
from purelight_format.networks.wire import require_small_structure

IR_VERSION = 10
OPSET = 18
ROWS = "N"
FLOAT_ATTRIBUTE, INT, GRAPH, INTS, GRAPHS = 1, 2, 5, 7, 10  # As in ONNX's AttributeProto.
VALUES = {FLOAT_ATTRIBUTE: "f", INT: "i", INTS: "ints"}
FLAGS = (
    "allowzero", "exclusive", "fmod", "keepdims", "noop_with_empty_axes", "reverse", "transA",
    "transB",
)  # fmt: skip


@dataclass(frozen=True)
class NetworkCost:
    """What one evaluation takes.

    Arguments:
        macs_per_sample: multiply-adds of matrix products.
        floats_per_sample: elements of all intermediates.
        nanoseconds: of one sample on one core, see `onnx_cost`.
        bytes: size of the model.
        warnings: what is unusual but harmless.
        shapes: sizes of one row of every value, by name.
    """

    macs_per_sample: int
    floats_per_sample: int
    nanoseconds: float
    bytes: int
    warnings: tuple[Issue, ...] = ()
    shapes: Mapping[str, Shape] = field(default_factory=dict, repr=False, compare=False)


def inspect(model: bytes, network: str, where: str = "", limits: Limits = LIMITS) -> NetworkCost:
    """Vets a network.

    Arguments:
        model: ONNX bytes.
        network: a key of `vectors.SIGNATURES`.
        where: the location that issues name.
        limits: what is accepted.

    Returns:
        Its cost per sample.

    Raises:
        FormatError: With a PLX_ONNX code.
    """
    where = where or members.network(network)
    try:
        proto = _parse(model, where, limits)
        return _inspect(proto, network, where, len(model), limits)
    except UnicodeDecodeError:
        fail("PLX_ONNX_PARSE", where)


def _parse(model: bytes, where: str, limits: Limits) -> Any:
    if len(model) > limits.network_bytes:
        _too_large(where, "bytes", len(model), limits.network_bytes)
    require_small_structure(model, where, limits)
    try:
        return load(model)
    except BrokenMessageError:
        fail("PLX_ONNX_PARSE", where)


def _inspect(proto: Any, network: str, where: str, size: int, limits: Limits) -> NetworkCost:
    graph = proto.graph
    _require_header(proto, where)
    _require_features(proto, where)
    _require_counts(graph, where, limits)
    signature = SIGNATURES[network]
    _require_signature(graph.input, signature.inputs, f"{where}:inputs")
    _require_signature(graph.output, signature.outputs, f"{where}:outputs")
    values, (macs, floats, work) = foretell(graph, signature.inputs, where, limits)
    _require_outputs(values, signature.outputs, where)
    shapes = {name: tensor.shape for name, tensor in values.items()}
    return NetworkCost(macs, floats, work, size, tuple(_warnings(proto, where)), shapes)


def foretell(
    graph: Any, inputs: Mapping[str, Shape], where: str = "", limits: Limits = LIMITS
) -> tuple[dict[str, Tensor], tuple[int, int, float]]:
    """Type and shape of every value of a graph, and its cost, from those of its inputs.

    Arguments:
        graph: a GraphProto.
        inputs: sizes of one row of each.

    Returns:
        The values by name; multiply-adds, elements and nanoseconds per row.

    Raises:
        FormatError: With a PLX_ONNX code.
    """
    values = {name: Tensor(FLOAT, tuple(shape)) for name, shape in inputs.items()}
    for tensor in graph.initializer:
        _define(values, tensor.name, _initializer(tensor, where, limits), where)
    return values, _walk(graph.node, values, where, limits)


def _too_large(where: str, what: str, size: int, limit: int) -> None:
    fail("PLX_ONNX_TOO_LARGE", where, what=what, size=size, limit=limit)


# The model around the graph


def _require_header(proto: Any, where: str) -> None:
    if not proto.HasField("graph"):
        fail("PLX_ONNX_PARSE", where)
    if proto.ir_version != IR_VERSION:
        fail("PLX_ONNX_IR_VERSION", where, version=proto.ir_version, expected=IR_VERSION)
    for opset in proto.opset_import:
        _require_domain(opset.domain, where)
    versions = [opset.version for opset in proto.opset_import]
    if versions != [OPSET]:
        fail("PLX_ONNX_OPSET", where, version=versions[:4], expected=OPSET)


def _require_domain(domain: str, where: str) -> None:
    if domain not in ("", "ai.onnx"):
        fail("PLX_ONNX_FOREIGN_DOMAIN", where, domain=domain[:80])


def _require_features(proto: Any, where: str) -> None:
    """What ONNX can hold besides nodes and initializers has no place here."""
    graph = proto.graph
    features = {
        "local functions": proto.functions,
        "training graphs": proto.training_info,
        "sparse initializers": graph.sparse_initializer,
        "quantization annotations": graph.quantization_annotation,
        "stated shapes of intermediates": graph.value_info,
    }
    for feature, found in features.items():
        if len(found):
            fail("PLX_ONNX_FEATURE", where, feature=feature)


def _require_counts(graph: Any, where: str, limits: Limits) -> None:
    if len(graph.node) > limits.nodes:
        _too_large(where, "nodes", len(graph.node), limits.nodes)
    if len(graph.initializer) > limits.initializers:
        _too_large(where, "initializers", len(graph.initializer), limits.initializers)
    named = [node.name for node in graph.node if node.name]
    if not all(map(_is_name, named)):
        fail("PLX_ONNX_NAME_INVALID", where)
    if len(set(named)) != len(named):
        fail("PLX_ONNX_DUPLICATE_NAME", where, name="of a node")


def _require_signature(values: Any, expected: Shapes, where: str) -> None:
    """Names in order, float32, rows named N, and fixed sizes."""
    found = [_describe(value) for value in values[: len(expected) + 1]]
    wanted = [(name, 1, (ROWS, *shape)) for name, shape in expected.items()]
    if found != wanted:
        text = ", ".join(f"{name}[{','.join(map(str, dims))}]" for name, _, dims in wanted)
        fail("PLX_ONNX_IO_SIGNATURE", where, what="inputs and outputs", expected=f"{text} float32")


def _describe(value: Any) -> tuple[str, int, tuple[Any, ...]]:
    kind = value.type.tensor_type
    dims = [d.dim_value if d.HasField("dim_value") else d.dim_param for d in kind.shape.dim[:8]]
    return value.name, kind.elem_type, tuple(dims)


def _warnings(proto: Any, where: str) -> Iterator[Issue]:
    graph = proto.graph
    read = {name for node in graph.node for name in node.input}
    for tensor in graph.initializer:
        if tensor.name not in read:
            yield issue("PLX_ONNX_UNUSED_INITIALIZER", f"{where}:{tensor.name[:80]}")
    parts = (proto, graph, *graph.node, *graph.initializer)
    if any(part.metadata_props or part.doc_string for part in parts):
        yield issue("PLX_ONNX_METADATA", where)


# Initializers


def _initializer(tensor: Any, where: str, limits: Limits) -> Tensor:
    """A constant, read without a copy; only raw data of the declared size is accepted."""
    where = f"{where}:{tensor.name[:80]}"
    if tensor.data_location or len(tensor.external_data):
        fail("PLX_ONNX_EXTERNAL_DATA", where)
    if tensor.data_type not in TYPES:
        fail("PLX_ONNX_TENSOR_TYPE", where, type=tensor.data_type)
    dtype, shape = TYPES[tensor.data_type], tuple(tensor.dims)
    if len(shape) > limits.tensor_rank or any(size < 1 for size in shape):
        fail("PLX_ONNX_TENSOR_DATA", where, what=f"sizes {shape[:8]} are not allowed")
    if math.prod(shape) * dtype.itemsize != len(tensor.raw_data) or _has_other_data(tensor):
        fail("PLX_ONNX_TENSOR_DATA", where, what="raw data of the declared size is required")
    value = np.frombuffer(tensor.raw_data, dtype.newbyteorder("<")).reshape(shape)
    if dtype == FLOAT and not np.isfinite(value).all():
        fail("PLX_ONNX_NON_FINITE_WEIGHT", where)
    return Tensor(dtype, shape, value)


def _has_other_data(tensor: Any) -> bool:
    fields = ("float", "int32", "int64", "double", "uint64", "string")
    return tensor.HasField("segment") or any(len(getattr(tensor, f"{f}_data")) for f in fields)


# Nodes


def _is_name(name: str | bytes) -> bool:
    """Whether it is printable; one that is not UTF-8 comes from protobuf as bytes."""
    return isinstance(name, str) and bool(name) and name.isprintable()


def _define(values: dict[str, Tensor], name: str, tensor: Tensor, where: str) -> None:
    if not _is_name(name):
        fail("PLX_ONNX_NAME_INVALID", where)
    if name in values:
        fail("PLX_ONNX_DUPLICATE_NAME", where, name=name[:80])
    values[name] = tensor


def _walk(
    nodes: Any, values: dict[str, Tensor], where: str, limits: Limits
) -> tuple[int, int, float]:
    """Gives every value its shape: multiply-adds, floats and nanoseconds per sample."""
    macs, floats, work = 0, 0, 0.0
    for index, proto in enumerate(nodes):
        node = _node(proto, values, f"{where}:node {index}", limits)
        if all(tensor is None or tensor.value is not None for tensor in node.inputs):
            node.bad_shape("no input depends on the network's inputs")
        outputs = OPERATORS[node.op].rule(node)
        if len(outputs) != len(proto.output):
            fail("PLX_ONNX_ATTRIBUTE", node.where, what=f"{node.op} has {len(outputs)} outputs")
        for name, tensor in zip(proto.output, outputs, strict=True):
            _require_size(tensor, node, limits)
            _define(values, name, tensor, node.where)
            floats += tensor.size
        macs, work = macs + products(node), work + nanoseconds(node, outputs)
        _require_cost(node.where, macs, floats, work, limits)
    return macs, floats, work


def _node(proto: Any, values: dict[str, Tensor], where: str, limits: Limits) -> Node:
    _require_domain(proto.domain, where)
    if proto.op_type not in OPERATORS or proto.overload:
        fail("PLX_ONNX_OP_NOT_ALLOWED", where, op=proto.op_type[:80])
    operator = OPERATORS[proto.op_type]
    count = len(proto.input)
    most = min(operator.most, limits.node_inputs)
    if not operator.least <= count <= most or len(proto.output) > limits.node_outputs:
        what = f"{proto.op_type} with {count} inputs and {len(proto.output)} outputs"
        fail("PLX_ONNX_ATTRIBUTE", where, what=what)
    for name in proto.input:
        if name and name not in values:
            fail("PLX_ONNX_UNDEFINED_NAME", where, name=name[:80])
    inputs = tuple(values[name] if name else None for name in proto.input)
    attributes = _attributes(proto, operator.attributes, where, limits)
    return Node(proto.op_type, where, inputs, attributes, len(proto.output))


def _attributes(proto: Any, allowed: tuple[str, ...], where: str, limits: Limits) -> dict[str, Any]:
    attributes: dict[str, Any] = {}
    for attribute in proto.attribute:
        name = attribute.name
        if attribute.type in (GRAPH, GRAPHS) or attribute.HasField("g") or attribute.graphs:
            fail("PLX_ONNX_SUBGRAPH", where, name=name[:80])
        if name not in allowed or name in attributes or attribute.ref_attr_name:
            fail("PLX_ONNX_ATTRIBUTE", where, what=f"{proto.op_type}: attribute {name[:80]!r}")
        stated = {field.name for field, _ in attribute.ListFields()}
        if stated - {"name", "type", VALUES.get(attribute.type)}:
            fail("PLX_ONNX_ATTRIBUTE", where, what=f"{proto.op_type}: {name[:80]!r} holds more")
        attributes[name] = _attribute(attribute, where, limits)
    return attributes


def _attribute(attribute: Any, where: str, limits: Limits) -> Any:
    """The value of an attribute of the type and range that its name has in ONNX."""
    name, kind = attribute.name, attribute.type
    if name in ("alpha", "beta") and kind == FLOAT_ATTRIBUTE:
        return attribute.f
    if name == "perm" and kind == INTS and len(attribute.ints) <= limits.tensor_rank:
        return list(attribute.ints)
    if name in ("axis", "to") and kind == INT:
        return attribute.i
    if name in FLAGS and kind == INT and attribute.i in (0, 1):
        return attribute.i
    return fail("PLX_ONNX_ATTRIBUTE", where, what=f"{name}: wrong type or range")


def _require_size(tensor: Tensor, node: Node, limits: Limits) -> None:
    if not tensor.size or len(tensor.shape) + 1 > limits.tensor_rank:
        node.bad_shape(f"the result {tensor.shape} is empty or has too many axes")
    if tensor.size > limits.sample_floats:
        _too_costly(node.where, tensor.size, "elements", limits.sample_floats)


def _require_cost(where: str, macs: int, floats: int, work: float, limits: Limits) -> None:
    if macs > limits.sample_macs:
        _too_costly(where, macs, "multiply-adds", limits.sample_macs)
    if floats > limits.sample_floats_sum:
        _too_costly(where, floats, "elements in all", limits.sample_floats_sum)
    if work > limits.sample_nanoseconds:
        _too_costly(where, round(work), "nanoseconds of work", limits.sample_nanoseconds)


def _too_costly(where: str, size: int, what: str, limit: int) -> None:
    fail("PLX_ONNX_COST", where, size=size, what=what, limit=limit)


def _require_outputs(values: dict[str, Tensor], expected: Shapes, where: str) -> None:
    for name, shape in expected.items():
        found = values.get(name)
        if found is None or found.value is not None:
            fail("PLX_ONNX_UNDEFINED_NAME", f"{where}:outputs", name=name)
        if (found.dtype, found.shape) != (FLOAT, shape):
            what = f"{name}, computed as {found.dtype} {found.shape},"
            fail(
                "PLX_ONNX_IO_SIGNATURE", f"{where}:outputs", what=what, expected=f"float32 {shape}"
            )
