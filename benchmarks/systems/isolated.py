"""Work in a process of its own, whose results come back one by one."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from purelight_format.errors import PureLightError

Generator = Callable[..., Iterator[Any]]


def results(make: Generator, *arguments: Any) -> Iterator[Any]:
    """What `make(*arguments)` yields, made in a fresh process (spawn), which it may well end.

    Arguments:
        make: a function of a module, or a method of what can be pickled, as are the arguments.

    Raises:
        PureLightError: raised there, or the process came to an end, with the reason.
    """
    context = multiprocessing.get_context("spawn")
    mine, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_serve, args=(theirs, make, arguments))
    process.start()
    theirs.close()
    try:
        while (message := _receive(mine, process)) is not None:
            yield message
    finally:
        process.kill()
        process.join()
        mine.close()


def _receive(
    pipe: multiprocessing.connection.Connection, process: multiprocessing.process.BaseProcess
) -> Any:
    """The next result, None after the last."""
    try:
        kind, value = pipe.recv()
    except EOFError:
        process.join()
        raise PureLightError(f"its process {_end(process.exitcode or 0)}") from None
    if kind == "error":
        raise PureLightError(value)
    return value if kind == "result" else None


def _end(code: int) -> str:
    return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with code {code}"


def _serve(pipe: multiprocessing.connection.Connection, make: Generator, arguments: Any) -> None:
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        for value in make(*arguments):
            pipe.send(("result", value))
        pipe.send(("end", None))
    except PureLightError as error:
        pipe.send(("error", str(error)))
    except Exception as error:  # of a library: one line for the table, the rest for the log
        traceback.print_exc()
        line = " ".join(str(error).split())[:200]
        pipe.send(("error", f"{type(error).__name__}: {line}"))
    pipe.close()
    sys.stdout.flush()
    os._exit(0)  # without what libraries do at their end: some abort


def _end_with_parent() -> None:
    """Leave no orphan at work when the benchmark is interrupted."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        multiprocessing.connection.wait([parent.sentinel])
        os._exit(1)


def peak_megabytes() -> float | None:
    """Peak resident memory of this process in MB (10⁶ bytes), None where the system does not tell.

    Linux does; `getrusage` would give that of the process that started it where that was larger.
    """
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return None
    sizes = [int(line.split()[1]) for line in lines if line.startswith("VmHWM:")]
    return sizes[0] * 1024 / 1e6 if sizes else None
