"""A lamp's C++ as a library of this machine, called from Python: rows of NumPy in and out."""

from __future__ import annotations

import ctypes
import os
import shlex
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import purelight_cpp
from purelight_format import atomic
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError
from purelight_format.issues import plain
from purelight_shader.output.folder import write

NAMES = ("c++", "g++", "clang++")
FLAGS = ("-std=c++17", "-shared", "-fPIC", "-fvisibility=hidden")
LAMP = """\
#include "lamp.h"
#define PURELIGHT_OPEN purelight_lamp::open
#include "purelight_c.h"
"""
NO_LAMP = """\
#include "purelight.h"
inline std::unique_ptr<purelight::Lamp> none(const std::string&)
{
    throw purelight::Error("no lamp is compiled in");
}
#define PURELIGHT_OPEN none
#include "purelight_c.h"
"""
SECONDS = 600
Array = np.ndarray


def compiler() -> list[str]:
    """The system's C++ compiler: that of the variable CXX, or one on the path.

    Raises:
        PureLightError: If there is none.
    """
    named = shlex.split(os.environ.get("CXX", ""))
    found = next(filter(None, map(shutil.which, named[:1] or NAMES)), None)
    if found is None:
        raise PureLightError("no C++ compiler was found: install g++ or clang++, or set CXX")
    return [found, *named[1:]]


def build(bundle: Bundle, folder: Path, flags: Sequence[str] = ("-O2",)) -> Library:
    """Writes a lamp's C++ into a folder, compiles it there, and opens it.

    Raises:
        PureLightError: If there is no Slang or C++ compiler, or one of them fails.
    """
    compiler()  # Known to be there before anything is written.
    write(bundle, "cpp", folder)
    library = Library(_compiled(folder, LAMP, flags))
    library.open(folder)
    return library


def measures(folder: Path) -> Library:
    """The functions of `purelight.h` that need no lamp, compiled in a folder."""
    header = purelight_cpp.source(purelight_cpp.HEADER)
    atomic.write_bytes(folder / purelight_cpp.HEADER, header.encode())
    return Library(_compiled(folder, NO_LAMP, ("-O1",)))


def _compiled(folder: Path, source: str, flags: Sequence[str]) -> Path:
    interface = purelight_cpp.source(purelight_cpp.INTERFACE)
    atomic.write_bytes(folder / purelight_cpp.INTERFACE, interface.encode())
    atomic.write_bytes(folder / "library.cpp", source.encode())
    words = [*compiler(), *FLAGS, *flags, "library.cpp", "-o", "library.so"]
    try:
        done = subprocess.run(
            words, cwd=folder, capture_output=True, text=True, timeout=SECONDS, check=False
        )
    except subprocess.TimeoutExpired:
        raise PureLightError(f"{words[0]} took more than {SECONDS} s") from None
    if done.returncode != 0:
        reason = next((x for x in done.stderr.splitlines() if "error" in x), "it gave no reason")
        raise PureLightError(f"{words[0]} refused the lamp: {plain(reason, 300)}")
    return folder / "library.so"


class Library:
    """A compiled library, and the lamp in it once it is open.

    Arguments:
        path: where it lies.
    """

    def __init__(self, path: Path) -> None:
        self._library = ctypes.CDLL(str(path))
        self._lamp = ctypes.c_void_p()

    def open(self, folder: Path) -> None:
        """Reads the buffers of the lamp.

        Raises:
            PureLightError: If they do not belong to the code.
        """
        function = self._function("open", ctypes.c_char_p)
        _require(function(os.fsencode(folder), ctypes.byref(self._lamp)))

    def close(self) -> None:
        """Lets go of the lamp's buffers."""
        self._library.purelight_close(self._lamp)
        self._lamp = ctypes.c_void_p()

    def ask(
        self, name: str, inputs: Sequence[Array], outputs: Sequence[int], *leading: Any
    ) -> list[Array]:
        """Calls a function of the open lamp.

        Arguments:
            inputs: [N, ...] each.
            outputs: numbers in a row of each result.
            leading: arguments between the lamp and the rows.

        Returns:
            The results, [N, size] each.

        Raises:
            PureLightError: If the function refuses.
        """
        if not self._lamp:
            raise PureLightError("open a lamp first")
        before = (self._lamp, *leading)
        return self._call(name, before, inputs, outputs, ctypes.c_char_p)

    def caller(
        self, name: str, inputs: Sequence[Array], outputs: Sequence[int], rows: int
    ) -> Callable[[], None]:
        """A function of the open lamp on the first rows, ready to be called and timed."""
        given = [np.ascontiguousarray(array[:rows], np.float32) for array in inputs]
        results = [np.empty((rows, size), np.float32) for size in outputs]
        function, count = self._function(name, ctypes.c_char_p), ctypes.c_size_t(rows)
        pointers = [pointer(array) for array in (*given, *results)]
        return lambda: _require(function(self._lamp, count, *pointers))

    def measure(
        self, name: str, inputs: Sequence[Array], outputs: Sequence[int], *leading: Any
    ) -> list[Array]:
        """Calls a function that needs no lamp; `leading` arguments stand behind the rows."""
        return self._call(name, (), inputs, outputs, None, leading)

    def _function(self, name: str, returned: Any) -> Any:
        function = getattr(self._library, f"purelight_{name}")
        function.restype = returned
        return function

    def _call(
        self,
        name: str,
        before: Sequence[Any],
        inputs: Sequence[Array],
        outputs: Sequence[int],
        returned: Any,
        behind: Sequence[Any] = (),
    ) -> list[Array]:
        given = [np.ascontiguousarray(array, np.float32) for array in inputs]
        results = [np.empty((len(given[0]), size), np.float32) for size in outputs]
        pointers = [pointer(array) for array in (*given, *results)]
        rows = ctypes.c_size_t(len(given[0]))
        _require(self._function(name, returned)(*before, rows, *behind, *pointers))
        return results


def pointer(array: Array) -> ctypes.c_void_p:
    """Where the numbers of an array lie; it must live as long as they are read."""
    return array.ctypes.data_as(ctypes.c_void_p)


def _require(fault: bytes | int | None) -> None:
    if isinstance(fault, bytes):
        raise PureLightError(fault.decode(errors="replace"))
