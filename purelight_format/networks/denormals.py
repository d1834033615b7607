"""Numbers below 1e-38 as zero: some processors take many times as long for them.

A processor's mode belongs to a thread, and Python has no word for it. The C library has: here its
floating-point environment is read, changed and written back. ARM processors need nothing of this.
"""

from __future__ import annotations

import ctypes
import functools
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager

FLUSH = 0x8040  # Of MXCSR: results that are denormal become zero, operands count as zero.
# Bytes of fenv_t, and where MXCSR lies in it, by C library (x86-64)
LAYOUTS = {"linux": (32, 28), "darwin": (16, 4)}


def flush() -> None:
    """Denormal numbers count as zero in this thread from now on, where that makes a difference."""
    _set(_get() | FLUSH)


@contextmanager
def flushed() -> Iterator[None]:
    """Denormal numbers count as zero in this thread within the block."""
    before = _get()
    _set(before | FLUSH)
    try:
        yield
    finally:
        _set(before)


def supported() -> bool:
    """Whether the mode of this machine is known."""
    return _library() is not None


@functools.cache
def _library() -> ctypes.CDLL | None:
    """The C library, if it can read and write the environment as `LAYOUTS` says."""
    if platform.machine().lower() not in ("x86_64", "amd64") or sys.platform not in LAYOUTS:
        return None
    try:
        library = ctypes.CDLL("libm.so.6" if sys.platform == "linux" else None)
    except OSError:
        return None
    return library if hasattr(library, "fesetenv") else None


def _get() -> int:
    """MXCSR, 0 where it is unknown."""
    if (library := _library()) is None:
        return 0
    state, offset = _environment(library)
    return int.from_bytes(state.raw[offset : offset + 4], sys.byteorder)


def _set(mode: int) -> None:
    if (library := _library()) is None:
        return
    state, offset = _environment(library)
    changed = state.raw[:offset] + mode.to_bytes(4, sys.byteorder) + state.raw[offset + 4 :]
    library.fesetenv(ctypes.create_string_buffer(changed, len(changed)))


def _environment(library: ctypes.CDLL) -> tuple[ctypes.Array[ctypes.c_char], int]:
    """The thread's fenv_t, and where MXCSR lies in it."""
    size, offset = LAYOUTS[sys.platform]
    state = ctypes.create_string_buffer(size)
    library.fegetenv(state)
    return state, offset
