"""Protocol buffers, as far as an ONNX model needs them: read by a table of fields, nothing else."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

VARINT, FIXED64, BYTES, OPEN, CLOSE, FIXED32 = range(6)  # Types on the wire.
SIZES = {FIXED64: 8, FIXED32: 4}
DEEPEST = 100  # Nested messages, as protobuf itself has it.
DEFAULTS = {"int": 0, "int32": 0, "float": 0.0, "fixed64": 0.0, "text": "", "bytes": b""}


class BrokenMessageError(ValueError):
    """The bytes are no message."""


@dataclass(frozen=True)
class Field:
    """A field of a message.

    Arguments:
        name: of it.
        kind: `int`, `int32`, `float`, `fixed64`, `text`, `bytes`, or the name of a message.
        many: whether it is a list.
        either: names of fields that exclude each other, this one among them.
        known: values of an enumeration; others count as unknown fields.
    """

    name: str
    kind: str
    many: bool = False
    either: tuple[str, ...] = ()
    known: range | None = None


Schema = Mapping[str, Mapping[int, Field]]


class Message:
    """What was read; a field that is absent has its default, as in protobuf.

    Arguments:
        schema: fields of every message by number.
        kind: which one this is.
    """

    def __init__(self, schema: Schema, kind: str) -> None:
        self._schema, self._fields = schema, schema[kind]

    def __getattr__(self, name: str) -> Any:
        field = next((f for f in self._fields.values() if f.name == name), None)
        if field is None:
            raise AttributeError(name)
        if field.many:
            return ()
        default = DEFAULTS.get(field.kind)
        return Message(self._schema, field.kind) if default is None else default

    def HasField(self, name: str) -> bool:  # noqa: N802
        """Whether the field was given; the name is protobuf's."""
        return name in self.__dict__

    def ListFields(self) -> list[tuple[Field, Any]]:  # noqa: N802
        """The fields that were given; the name is protobuf's."""
        found = sorted((number, f) for number, f in self._fields.items() if self.HasField(f.name))
        return [(field, self.__dict__[field.name]) for _, field in found]

    def merge(self, data: memoryview, depth: int = 0) -> None:
        """Reads fields into this message; what was there stays, as protobuf has it.

        Raises:
            BrokenMessageError: If the bytes are no message.
        """
        if depth > DEEPEST:
            raise BrokenMessageError("nested too deep")
        for number, wire, value in _fields(data, depth):
            field = self._fields.get(number)
            if field is not None:
                self._store(field, wire, value, depth)

    def _store(self, field: Field, wire: int, value: Any, depth: int) -> None:
        """Keeps a value; of another type on the wire, it is of a field that is not known."""
        if field.kind in self._schema:
            values = [value] if wire == BYTES else []
        else:
            values = _values(field, wire, value)
        if not values or (field.known is not None and values[0] not in field.known):
            return
        for other in field.either:
            if other != field.name:
                self.__dict__.pop(other, None)
        if field.kind in self._schema:
            self._store_message(field, values[0], depth)
        elif field.many:
            self.__dict__.setdefault(field.name, []).extend(values)
        else:
            self.__dict__[field.name] = values[-1]

    def _store_message(self, field: Field, data: memoryview, depth: int) -> None:
        inner = None if field.many else self.__dict__.get(field.name)
        if inner is None:
            inner = Message(self._schema, field.kind)
            if field.many:
                self.__dict__.setdefault(field.name, []).append(inner)
            else:
                self.__dict__[field.name] = inner
        inner.merge(data, depth + 1)


def _values(field: Field, wire: int, value: Any) -> list[Any]:
    kind = field.kind
    if kind in ("text", "bytes"):
        return [_text(bytes(value)) if kind == "text" else bytes(value)] if wire == BYTES else []
    if kind in ("float", "fixed64"):
        code, size = ("<f", 4) if kind == "float" else ("<d", 8)
        if wire == (FIXED32 if kind == "float" else FIXED64):
            return [*struct.unpack(code, value)]
        if not (field.many and wire == BYTES):
            return []
        if len(value) % size:
            raise BrokenMessageError("half a number")
        return [number for (number,) in struct.iter_unpack(code, value)]
    if wire == VARINT:
        return [_integer(kind, value)]
    return _packed(kind, value) if field.many and wire == BYTES else []


def _text(data: bytes) -> str | bytes:
    """Text, or the bytes as they are: what reads them refuses those."""
    try:
        return data.decode()
    except UnicodeDecodeError:
        return data


def _integer(kind: str, value: int) -> int:
    bits = 32 if kind == "int32" else 64
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


def _packed(kind: str, data: memoryview) -> list[int]:
    values, position = [], 0
    while position < len(data):
        value, position = _varint(data, position)
        values.append(_integer(kind, value))
    return values


def _fields(data: memoryview, depth: int) -> Iterator[tuple[int, int, Any]]:
    """Number, type on the wire, and a number or the bytes, of every field."""
    position = 0
    while position < len(data):
        number, wire, value, position = _field(data, position, depth)
        yield number, wire, value


def _field(data: memoryview, position: int, depth: int) -> tuple[int, int, Any, int]:
    tag, position = _varint(data, position)
    number, wire = tag >> 3, tag & 7
    if tag > 0xFFFFFFFF or not number:
        raise BrokenMessageError("no field has this number")
    if wire == VARINT:
        value, position = _varint(data, position)
        return number, wire, value, position
    if wire == OPEN:
        return number, wire, None, _after_group(data, position, number, depth + 1)
    if wire == BYTES:
        size, position = _varint(data, position)
    elif wire in SIZES:
        size = SIZES[wire]
    else:
        raise BrokenMessageError("no such type")
    if position + size > len(data):
        raise BrokenMessageError("cut off")
    return number, wire, data[position : position + size], position + size


def _after_group(data: memoryview, position: int, number: int, depth: int) -> int:
    if depth > DEEPEST:
        raise BrokenMessageError("nested too deep")
    while True:
        tag, after = _varint(data, position)
        if tag & 7 == CLOSE:
            if tag >> 3 != number:
                raise BrokenMessageError("another group ends")
            return after
        *_, position = _field(data, position, depth)


def _varint(data: memoryview, position: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if position >= len(data):
            break
        byte = data[position]
        position += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, position
    raise BrokenMessageError("a number is cut off")
