"""What every command has in common: faults of one line, exit codes, and pipes that may close."""

from __future__ import annotations

import argparse
import io
import math
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from typing import NoReturn

from purelight_format.errors import PureLightError
from purelight_format.issues import plain

FAULT = 2
PIPE_CLOSED = 141  # What a shell reports of a command that its reader's end has stopped.
LONGEST = 2000
SEEDS = 1 << 32  # What Mitsuba takes, and Torch once stages and steps are counted in.


class Parser(argparse.ArgumentParser):
    """Says in one line what is wrong with a command's arguments, and what may stand there."""

    def error(self, message: str) -> NoReturn:
        """Prints the line and ends the process with `FAULT`."""
        _say(self.prog, f"{message}; see {self.prog} --help")
        raise SystemExit(FAULT)


def number(low: float, high: float = math.inf) -> Callable[[str], float]:
    """A type of arguments: numbers between two others, which do not belong to it."""
    wanted = f"above {low:g}" if high == math.inf else f"between {low:g} and {high:g}"

    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low < value < high:
            raise argparse.ArgumentTypeError(f"{text}: give a number {wanted}")
        return value

    return read


def whole(low: int, high: int | None = None) -> Callable[[str], int]:
    """A type of arguments: whole numbers, both ends among them."""
    wanted = f"from {low}" if high is None else f"from {low} to {high}"

    def read(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if value < low or (high is not None and value > high):
            raise argparse.ArgumentTypeError(f"{text}: give a whole number {wanted}")
        return value

    return read


seed = whole(0, SEEDS - 1)


def day(text: str) -> str:
    """A type of arguments: dates as YYYY-MM-DD."""
    try:
        return datetime.strptime(text, "%Y-%m-%d").date().isoformat()
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text}: give a date such as 2026-01-31") from None


def run(name: str, action: Callable[[], int]) -> int:
    """Runs a command.

    Arguments:
        name: What it is called in errors.
        action: Does the work, arguments included, and returns the exit code.

    Returns:
        The exit code: that of the action, `FAULT` after one line about a fault that the user can
        mend, or `PIPE_CLOSED` if nobody reads its output any more (`purelight-inspect | head`).
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # A narrow encoding must not be a traceback.
            stream.reconfigure(errors="backslashreplace")
    try:
        try:
            return _run(name, action)
        finally:
            sys.stdout.flush()  # When Python ends, a closed pipe would be a traceback.
    except BrokenPipeError:
        _discard_output()
        return PIPE_CLOSED


def _run(name: str, action: Callable[[], int]) -> int:
    try:
        return action()
    except PureLightError as error:
        _say(name, str(error))
    except BrokenPipeError:
        raise
    except OSError as error:
        _say(name, f"{error.filename}: {error.strerror}" if error.filename else str(error))
    return FAULT


def note(name: str, text: str) -> None:
    """Prints one line about something that was done otherwise than one might think."""
    print(f"{name}: note: {plain(text, LONGEST)}", file=sys.stderr)


def warn(name: str, text: str) -> None:
    """Prints one line about something that the user should know."""
    print(f"{name}: warning: {plain(text, LONGEST)}", file=sys.stderr)


@contextmanager
def told(name: str) -> Iterator[None]:
    """Prints Python's warnings as one line each, and none twice."""
    shown: set[str] = set()

    def show(message: Warning | str, *_: object, **__: object) -> None:
        if str(message) not in shown:
            shown.add(str(message))
            warn(name, str(message))

    with warnings.catch_warnings():
        warnings.showwarning = show
        yield


def _say(name: str, text: str) -> None:
    print(f"{name}: error: {plain(text, LONGEST)}", file=sys.stderr)


def _discard_output() -> None:
    """Lets what cannot be printed any more go nowhere, so that Python ends without a fault."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except BrokenPipeError:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, stream.fileno())
            os.close(nowhere)
