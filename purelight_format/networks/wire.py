"""What a model holds besides its weights, counted on its bytes before protobuf parses them.

Two bytes can stand for an empty message that takes a hundred in memory, so a file far below its
limit could fill any machine. Here nothing is built: fields are stepped over.
"""

from __future__ import annotations

from collections.abc import Iterator

from purelight_format.issues import fail
from purelight_format.limits import Limits

GRAPH, INITIALIZER, RAW_DATA = 7, 5, 9  # Of ModelProto, GraphProto and TensorProto.
VARINT, FIXED64, BYTES, FIXED32 = 0, 1, 2, 5
FIELDS_EACH = 16  # Fields of an initializer: its sizes, name, type and data.

Span = tuple[int, int]


def require_small_structure(model: bytes, where: str, limits: Limits) -> None:
    """Bounds the bytes that are no weights.

    Raises:
        FormatError: PLX_ONNX_TOO_LARGE, or PLX_ONNX_PARSE if the bytes are no protobuf message.
    """
    steps = limits.nodes + FIELDS_EACH * limits.initializers
    walk = _Walk(model, where, steps)
    weights = 0
    for graph in walk.find((0, len(model)), GRAPH):
        for tensor in walk.find(graph, INITIALIZER):
            weights += sum(end - start for start, end in walk.find(tensor, RAW_DATA))
    size, limit = len(model) - weights, limits.network_structure_bytes
    if size > limit:
        fail("PLX_ONNX_TOO_LARGE", where, what="bytes besides weights", size=size, limit=limit)


class _Walk:
    """Steps over the fields of messages, a bounded number of them."""

    def __init__(self, data: bytes, where: str, steps: int) -> None:
        self._data, self._where, self._steps = data, where, steps
        self._left = steps

    def find(self, message: Span, number: int) -> Iterator[Span]:
        """Contents of the fields of one number that hold bytes."""
        position, end = message
        while position < end:
            tag, position = self._varint(position, end)
            start, position = self._content(tag & 7, position, end)
            if tag == number << 3 | BYTES:
                yield start, position

    def _content(self, kind: int, position: int, end: int) -> Span:
        self._left -= 1
        if self._left < 0:
            what, steps = "fields of model, graph and initializers", self._steps
            fail("PLX_ONNX_TOO_LARGE", self._where, what=what, size=f"over {steps}", limit=steps)
        if kind == VARINT:
            return position, self._varint(position, end)[1]
        size = {FIXED64: 8, FIXED32: 4}.get(kind, 0)
        if kind == BYTES:
            size, position = self._varint(position, end)
        if kind not in (FIXED64, FIXED32, BYTES) or position + size > end:
            fail("PLX_ONNX_PARSE", self._where)
        return position, position + size

    def _varint(self, position: int, end: int) -> tuple[int, int]:
        value = 0
        for shift in range(0, 70, 7):
            if position >= end:
                break
            byte = self._data[position]
            position += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value, position
        return fail("PLX_ONNX_PARSE", self._where)
