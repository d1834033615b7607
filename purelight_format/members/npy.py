"""Arrays as .npy bytes, read by a parser that accepts one canonical header and nothing else."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from purelight_format.issues import fail
from purelight_format.limits import LIMITS, Limits

MAGIC = b"\x93NUMPY\x01\x00"
ALIGNMENT = 64
HEADER = re.compile(
    rb"\{'descr': '(<f[48]|<u4|\|u1)', 'fortran_order': False, 'shape': \(([0-9, ]{0,64})\), \} *\n"
)


def dumps(array: np.ndarray) -> bytes:
    """Serialises an array as version 1.0 of the .npy format, the same bytes as `numpy.save`."""
    array = np.asarray(array, array.dtype.newbyteorder("<"))  # Scalars stay scalars.
    return _head(array.dtype.str, array.shape) + array.tobytes()


def _head(dtype: str, shape: tuple[int, ...]) -> bytes:
    """Everything before the data."""
    header = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {_shape_text(shape)}, }}"
    fill = -(len(MAGIC) + 2 + len(header) + 1) % ALIGNMENT
    text = header.encode() + b" " * fill + b"\n"
    return MAGIC + len(text).to_bytes(2, "little") + text


def loads(data: bytes, where: str, dtype: str, limits: Limits = LIMITS) -> np.ndarray:
    """Parses .npy bytes; nothing is allocated before the header is known to fit the data.

    Arguments:
        data: the member.
        where: the location that issues name.
        dtype: the element type that is expected, such as "<f4".
        limits: what is accepted.

    Returns:
        A read-only view of the data.

    Raises:
        FormatError: With a PLX_NPY code.
    """
    if len(data) > limits.array_bytes:
        fail("PLX_NPY_TOO_LARGE", where, size=len(data), limit=limits.array_bytes)
    if data[: len(MAGIC)] != MAGIC or len(data) < len(MAGIC) + 2:
        fail("PLX_NPY_HEADER", where, what="version 1.0 is required")
    start = len(MAGIC) + 2
    end = start + int.from_bytes(data[len(MAGIC) : start], "little")
    match = HEADER.fullmatch(data[start:end])
    if match is None:
        fail("PLX_NPY_HEADER", where, what="the header is not in canonical form")
    stored, sizes = match[1].decode(), match[2].decode().split(",")
    shape = tuple(int(size) for size in sizes if size.strip().isdecimal())
    if _head(stored, shape) != data[:end]:
        fail("PLX_NPY_HEADER", where, what="the header is not in canonical form")
    return _view(data[end:], where, dtype, stored, shape)


def _view(data: bytes, where: str, dtype: str, stored: str, shape: tuple[int, ...]) -> np.ndarray:
    if stored != dtype:
        fail("PLX_NPY_TYPE", where, dtype=stored, expected=dtype)
    expected = math.prod(shape) * np.dtype(dtype).itemsize
    # An empty array may state any other size, which NumPy itself could not hold.
    if len(data) != expected or max(shape, default=0) > LIMITS.array_bytes:
        fail("PLX_NPY_SIZE", where, size=len(data), expected=expected)
    array = np.frombuffer(data, dtype).reshape(shape)
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        fail("PLX_NPY_NON_FINITE", where)
    return array


def _shape_text(shape: tuple[int, ...]) -> str:
    return str(tuple(int(size) for size in shape))


def require_shape(array: np.ndarray, where: str, expected: tuple[int | None, ...]) -> None:
    """Compares a shape; None stands for any size.

    Raises:
        FormatError: PLX_NPY_SHAPE.
    """
    fits = array.ndim == len(expected) and all(
        wanted in (None, size) for size, wanted in zip(array.shape, expected, strict=True)
    )
    if not fits:
        wanted_text = ", ".join("any" if size is None else str(size) for size in expected)
        fail("PLX_NPY_SHAPE", where, shape=array.shape, expected=f"({wanted_text})")


def to_members(arrays: Mapping[str, np.ndarray]) -> dict[str, bytes]:
    """Serialises arrays by name."""
    return {name: dumps(array) for name, array in arrays.items()}
