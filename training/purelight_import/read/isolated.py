"""Readers of libraries in C++, in a process of their own: a broken file may end it, not ours."""

from __future__ import annotations

import importlib
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from purelight_format.errors import PureLightError

MEMORY = 24 << 30  # address space in bytes; LLVM alone reserves some of it
SECONDS = 900
START = "from purelight_import.read.isolated import child; child()"


def call(function: str, path: Path) -> Any:
    """Calls `module:function` with a path in a process of its own.

    Returns:
        What it returned.

    Raises:
        PureLightError: it raised that, or the process died.
        ValueError: it raised any other error, which is about a broken file.
    """
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer"
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
        try:
            done = subprocess.run(
                [sys.executable, "-c", START, function, str(path), str(answer)],
                env=environment, check=False, capture_output=True, timeout=SECONDS,
            )  # fmt: skip
        except subprocess.TimeoutExpired:
            raise PureLightError(f"{path}: not read after {SECONDS} s; it is too large") from None
        if done.returncode != 0 or not answer.is_file():
            raise ValueError("its reader came to a sudden end")
        kind, result = pickle.loads(answer.read_bytes())  # Written by our own process.
    if kind == "fault":
        raise PureLightError(result)
    if kind == "broken":
        raise ValueError(result)
    return result


def child() -> None:
    """What the process does: one call, whose answer it writes to a file."""
    function, path, answer = sys.argv[1:4]
    _limit_memory()
    module, _, name = function.partition(":")
    try:
        result = ("read", getattr(importlib.import_module(module), name)(Path(path)))
    except PureLightError as error:
        result = ("fault", str(error))
    except Exception as error:  # Whatever libraries raise about broken files.
        result = ("broken", str(error) or type(error).__name__)
    Path(answer).write_bytes(pickle.dumps(result))
    sys.stdout.flush()
    os._exit(0)  # Libraries that read a broken file may not end well.


def _limit_memory() -> None:
    """A count in a file must not take the machine's memory."""
    if sys.platform != "linux":
        return
    import resource

    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
