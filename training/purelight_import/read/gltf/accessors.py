"""Arrays of numbers: accessors into buffer views, strided, sparse and normalised ones too."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_import.model import limits
from purelight_import.read.gltf.document import Document, Object

KINDS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


def array(document: Document, index: Any) -> NDArray[Any]:
    """Values of an accessor: [count, width], float32 where normalised or stored so.

    Raises:
        ValueError: it is broken, or reaches beyond its data.
    """
    about = document.item("accessors", index)
    count, width = int(about["count"]), WIDTHS[about["type"]]
    kind = np.dtype(KINDS[about["componentType"]])
    if not 0 <= count <= limits.VERTICES:
        raise ValueError(f"accessor {index} has {count} values")
    if index in document.arrays:
        values = document.arrays[index]
        if values.shape != (count, width):
            raise ValueError(f"accessor {index} is not what its compressed data holds")
    elif "bufferView" in about:
        start = int(about.get("byteOffset", 0))
        values = _values(document, about["bufferView"], start, count, width, kind)
    else:
        values = np.zeros((count, width), kind)
    if "sparse" in about:
        values = _sparse(document, about["sparse"], values)
    return _normalized(values) if about.get("normalized") else values


def _values(
    document: Document, view: Any, start: int, count: int, width: int, kind: np.dtype[Any]
) -> NDArray[Any]:
    """Values [count, width] from a buffer view."""
    data = document.view(view)
    item = width * kind.itemsize
    stride = int(document.item("bufferViews", view).get("byteStride", item))
    if start < 0 or stride < item:
        raise ValueError("an accessor has no valid place")
    if count and start + (count - 1) * stride + item > len(data):
        raise ValueError("an accessor reaches beyond its data")
    if not count:
        return np.zeros((0, width), kind)
    return np.ndarray((count, width), kind, data, start, (stride, kind.itemsize)).copy()


def _sparse(document: Document, sparse: Object, values: NDArray[Any]) -> NDArray[Any]:
    """Values with some of them replaced."""
    count = int(sparse["count"])
    if not 0 <= count <= len(values):
        raise ValueError("a sparse accessor replaces more than there is")
    where, what = sparse["indices"], sparse["values"]
    kind = np.dtype(KINDS[where["componentType"]])
    if kind.kind != "u":
        raise ValueError("a sparse accessor has no valid indices")
    rows = _values(document, where["bufferView"], int(where.get("byteOffset", 0)), count, 1, kind)
    if count and rows.max() >= len(values):
        raise ValueError("a sparse accessor reaches beyond its data")
    start, width = int(what.get("byteOffset", 0)), values.shape[1]
    values[rows[:, 0]] = _values(document, what["bufferView"], start, count, width, values.dtype)
    return values


def _normalized(values: NDArray[Any]) -> NDArray[Any]:
    """Integers as numbers in [-1, 1] (glTF 2.0, 3.11)."""
    if values.dtype.kind == "f":
        return values
    scaled = values.astype(np.float32) / np.float32(np.iinfo(values.dtype).max)
    return np.maximum(scaled, -1)
