"""An ONNX model from its bytes: by the package `onnx`, or where there is none, by our own reader.

Both give the same fields under the same names. Blender's Python, for one, has NumPy and no ONNX.
"""

from __future__ import annotations

from typing import Any

from purelight_format.networks.messages import BrokenMessageError, Field, Message

TEXT, BYTES, INT = "text", "bytes", "int"
PROPERTIES = Field("metadata_props", "pair", many=True)
SIZE = ("dim_value", "dim_param")
KINDS = ("tensor_type", "sequence_type", "map_type", "sparse_tensor_type", "optional_type")


def _many(name: str, kind: str) -> Field:
    return Field(name, kind, many=True)


def _kind(name: str, message: str) -> Field:
    return Field(name, message, either=KINDS)


SCHEMA = {
    "empty": {},
    "pair": {1: Field("key", TEXT), 2: Field("value", TEXT)},
    "opset": {1: Field("domain", TEXT), 2: Field("version", INT)},
    "dimension": {
        1: Field("dim_value", INT, either=SIZE), 2: Field("dim_param", TEXT, either=SIZE),
    },
    "shape": {1: _many("dim", "dimension")},
    "tensor_type": {1: Field("elem_type", "int32"), 2: Field("shape", "shape")},
    "element": {1: Field("elem_type", "type")},
    "map": {2: Field("value_type", "type")},
    "type": {
        1: _kind("tensor_type", "tensor_type"), 4: _kind("sequence_type", "element"),
        5: _kind("map_type", "map"), 8: _kind("sparse_tensor_type", "tensor_type"),
        9: _kind("optional_type", "element"),
    },
    "value": {1: Field("name", TEXT), 2: Field("type", "type"), 3: Field("doc_string", TEXT),
              4: PROPERTIES},
    "tensor": {
        1: _many("dims", INT), 2: Field("data_type", "int32"), 3: Field("segment", "empty"),
        4: _many("float_data", "float"), 5: _many("int32_data", "int32"),
        6: _many("string_data", BYTES), 7: _many("int64_data", INT), 8: Field("name", TEXT),
        9: Field("raw_data", BYTES), 10: _many("double_data", "fixed64"),
        11: _many("uint64_data", INT), 12: Field("doc_string", TEXT),
        13: _many("external_data", "pair"), 14: Field("data_location", INT, known=range(2)),
        16: PROPERTIES,
    },
    "sparse": {1: Field("values", "tensor"), 2: Field("indices", "tensor")},
    "attribute": {
        1: Field("name", TEXT), 2: Field("f", "float"), 3: Field("i", INT), 4: Field("s", BYTES),
        5: Field("t", "tensor"), 6: Field("g", "graph"), 7: _many("floats", "float"),
        8: _many("ints", INT), 9: _many("strings", BYTES), 10: _many("tensors", "tensor"),
        11: _many("graphs", "graph"), 13: Field("doc_string", TEXT), 14: Field("tp", "type"),
        15: _many("type_protos", "type"), 20: Field("type", INT, known=range(15)),
        21: Field("ref_attr_name", TEXT), 22: Field("sparse_tensor", "sparse"),
        23: _many("sparse_tensors", "sparse"),
    },
    "node": {
        1: _many("input", TEXT), 2: _many("output", TEXT), 3: Field("name", TEXT),
        4: Field("op_type", TEXT), 5: _many("attribute", "attribute"),
        6: Field("doc_string", TEXT), 7: Field("domain", TEXT), 8: Field("overload", TEXT),
        9: PROPERTIES, 10: _many("device_configurations", "empty"),
    },
    "graph": {
        1: _many("node", "node"), 2: Field("name", TEXT), 5: _many("initializer", "tensor"),
        10: Field("doc_string", TEXT), 11: _many("input", "value"), 12: _many("output", "value"),
        13: _many("value_info", "value"), 14: _many("quantization_annotation", "empty"),
        15: _many("sparse_initializer", "sparse"), 16: PROPERTIES,
    },
    "function": {7: _many("node", "node")},
    "training": {1: Field("initialization", "graph"), 2: Field("algorithm", "graph")},
    "model": {
        1: Field("ir_version", INT), 6: Field("doc_string", TEXT), 7: Field("graph", "graph"),
        8: _many("opset_import", "opset"), 14: PROPERTIES, 20: _many("training_info", "training"),
        25: _many("functions", "function"), 26: _many("configuration", "empty"),
    },
}  # fmt: skip


def load(data: bytes) -> Any:
    """The `ModelProto`, or what reads like one.

    Arguments:
        data: ONNX bytes, whose size and structure are bounded already.

    Raises:
        BrokenMessageError: If they are no message.
    """
    try:
        import onnx
        from google.protobuf.message import DecodeError  # type: ignore[import-untyped]
    except ImportError:
        return own(data)
    try:
        return onnx.ModelProto.FromString(data)
    except DecodeError as error:
        raise BrokenMessageError("no message") from error


def own(data: bytes) -> Message:
    """The model by our own reader, see `load`."""
    model = Message(SCHEMA, "model")
    model.merge(memoryview(data))
    return model
