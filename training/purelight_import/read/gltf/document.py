"""The JSON of a glTF file, and its buffers."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.notes import Notes
from purelight_import.read.beside import beside

MAGIC, JSON_CHUNK, BINARY_CHUNK = b"glTF", 0x4E4F534A, 0x004E4942
COMPRESSED = ("EXT_meshopt_compression", "KHR_meshopt_compression")
Object = dict[str, Any]


@dataclass
class Document:
    """A glTF file.

    Arguments:
        path: of the file, beside which others lie.
        json: its content.
        binary: the buffer within a .glb file.
        packed: meshes that Draco compressed, by their buffer views.
        arrays: values of accessors that no buffer view holds as they are: [count, width].
    """

    path: Path
    json: Object
    binary: bytes | None
    notes: Notes
    buffers: dict[int, bytes] = field(default_factory=dict)
    packed: dict[int, Any] = field(default_factory=dict)
    arrays: dict[int, NDArray[Any]] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        return self.path.parent

    def item(self, kind: str, index: Any) -> Object:
        """An object of one of the file's arrays.

        Raises:
            ValueError: it is not there.
        """
        array = self.json.get(kind, [])
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(array):
            raise ValueError(f"{kind}[{index}] is not there")
        found = array[index]
        if not isinstance(found, dict):
            raise ValueError(f"{kind}[{index}] is no object")
        return found

    def buffer(self, index: Any) -> bytes:
        """The bytes of a buffer, which is read once."""
        about = self.item("buffers", index)
        if index not in self.buffers:
            data = self._bytes(about)
            if len(data) < int(about.get("byteLength", 0)):
                raise ValueError(f"buffer {index} ends early")
            self.buffers[index] = data
        return self.buffers[index]

    def _bytes(self, about: Object) -> bytes:
        uri = about.get("uri")
        if uri is None:
            if self.binary is None:
                raise ValueError("a buffer has no data")
            return self.binary
        return self.load(uri)

    def view(self, index: Any) -> bytes:
        """The bytes of a buffer view."""
        about = self.item("bufferViews", index)
        if set(COMPRESSED) & set(about.get("extensions", {})):
            raise PureLightError(
                f"{self.path}: its meshes are compressed (meshopt), which is not read; "
                "export the lamp without compression"
            )
        start, length = int(about.get("byteOffset", 0)), int(about["byteLength"])
        data = self.buffer(about["buffer"])
        if start < 0 or length < 0 or start + length > len(data):
            raise ValueError(f"bufferView {index} reaches beyond its buffer")
        return data[start : start + length]

    def load(self, uri: str, limit: int = limits.FILE_BYTES) -> bytes:
        """What a URI stands for: data within it, or a file in the folder."""
        if uri.startswith("data:"):
            head, _, body = uri.partition(",")
            if not head.endswith(";base64"):
                raise ValueError("a data URI is not in base64")
            try:
                return base64.b64decode(body, validate=True)
            except binascii.Error:
                raise ValueError("a data URI is not in base64") from None
        return files.read_file(beside(self.folder, uri, quoted=True), limit)


def open_document(path: Path, notes: Notes) -> Document:
    """Reads the container of a file.

    Raises:
        PureLightError: it cannot be read, or is no glTF 2.0.
        ValueError: it is broken.
    """
    data = files.read_file(path, limits.FILE_BYTES)
    binary = None
    if data[:4] == MAGIC:
        data, binary = _chunks(data)
    if len(data) > limits.TEXT_BYTES:
        raise PureLightError(f"{path}: its JSON has {len(data):,} bytes, too many to read")
    content = json.loads(data.decode("utf-8-sig"))
    if not isinstance(content, dict) or not isinstance(content.get("asset"), dict):
        raise ValueError("it has no asset, so it is no glTF")
    version = str(content["asset"].get("version", ""))
    if version.split(".")[0] != "2":
        raise PureLightError(f"{path}: glTF {version[:20]}; export the lamp as glTF 2.0")
    return Document(path, content, binary, notes)


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a .glb file."""
    if len(data) < 20:
        raise ValueError("the file ends early")
    version, length = struct.unpack_from("<II", data, 4)
    if version != 2:
        raise ValueError(f"it is GLB of version {version}, not 2")
    if length > len(data):
        raise ValueError("the file ends early")
    chunks: dict[int, bytes] = {}
    at = 12
    while at + 8 <= length:
        size, kind = struct.unpack_from("<II", data, at)
        if at + 8 + size > len(data):
            raise ValueError("the file ends early")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size + (-size) % 4
    return chunks[JSON_CHUNK], chunks.get(BINARY_CHUNK)
