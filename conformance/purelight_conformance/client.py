"""A host as the runner sees it: a program that may crash, hang, or talk nonsense."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as NoAnswer
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np

from purelight_conformance import protocol
from purelight_format.errors import PureLightError
from purelight_format.issues import plain


class HostError(PureLightError):
    """The host broke down; nothing more can be asked of it."""


class RefusalError(PureLightError):
    """The host said that it will not do this."""


@dataclass(frozen=True)
class Hello:
    """What a host says of itself."""

    name: str
    version: str
    operations: frozenset[str]


class Client:
    """Starts a host and asks it one thing at a time.

    Arguments:
        command: program and arguments; a text is split as a shell would.
        timeout: seconds that one answer may take.

    Raises:
        HostError: If it does not start.
    """

    def __init__(self, command: str | Sequence[str], timeout: float) -> None:
        self._timeout, self._count = timeout, 0
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed on exit
        self._worker = ThreadPoolExecutor(1)
        try:
            parts = shlex.split(command) if isinstance(command, str) else list(command)
            self._process = subprocess.Popen(
                parts, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors,
                start_new_session=True,
            )  # fmt: skip
        except (OSError, IndexError, ValueError) as error:
            self._errors.close()
            reason = getattr(error, "strerror", None) or "give a command"
            raise HostError(f"cannot start the host {command!r}: {reason}") from error

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        assert self._process.stdin is not None
        if kind is None:
            with suppress(OSError):
                self._process.stdin.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(min(self._timeout, 5.0))
        self._kill()
        self._worker.shutdown()
        self._errors.close()

    def hello(self) -> Hello:
        """Asks who it is.

        Raises:
            HostError: Also if it speaks another version of the protocol.
        """
        try:
            answer = self._ask("hello", {"do": "hello", "protocol": protocol.VERSION})
        except RefusalError as error:
            raise HostError(f"the host refused hello: {error}") from error
        version, operations = str(answer.get("protocol")), answer.get("operations")
        if version.split(".")[0] != protocol.VERSION.split(".")[0]:
            raise HostError(f"the host speaks version {version!r} of the protocol, not 1")
        if not isinstance(operations, list) or not all(isinstance(o, str) for o in operations):
            raise HostError("the host does not list its operations")
        name, release = (_line(answer.get(key, "?"), 80) for key in ("host", "version"))
        return Hello(name, release, frozenset(operations))

    def open(self, path: str) -> None:
        """Opens a bundle.

        Raises:
            RefusalError: If the host will not.
        """
        self._ask(f"open {path}", {"do": "open", "bundle": path})

    def evaluate(
        self,
        what: str,
        operation: str,
        parameters: Mapping[str, Any],
        inputs: Mapping[str, np.ndarray],
    ) -> dict[str, np.ndarray]:
        """Evaluates rows.

        Arguments:
            what: how to call this in errors.

        Raises:
            RefusalError: If the host will not.
        """
        task = {"do": "evaluate", "operation": operation, "parameters": parameters}
        answer = self._ask(what, {**task, "inputs": protocol.encode(inputs)})
        try:
            return protocol.decode(answer.get("outputs"))
        except PureLightError as error:
            raise HostError(f"the host's answer to {what}: {error}") from error

    def end(self) -> None:
        """Ends the host's input, upon which it must end with exit code 0 and say no more (H1).

        Raises:
            HostError: If it does not.
        """
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            rest = self._worker.submit(self._rest).result(self._timeout)
            code = self._process.wait(self._timeout)
        except (NoAnswer, subprocess.TimeoutExpired):
            self._kill()
            text = f"the host did not end within {self._timeout:g} s of the end of its input"
            raise HostError(text) from None
        if rest:
            raise HostError(f"the host wrote more than its answers: {rest[:60]!r}")
        if code:
            raise HostError(f"the host ended with exit code {code} at the end of its input, not 0")

    def _ask(self, what: str, request: Mapping[str, Any]) -> dict[str, Any]:
        self._count += 1
        line = protocol.dumps({"id": self._count, **request})
        try:
            raw = self._worker.submit(self._exchange, line).result(self._timeout)
        except NoAnswer:
            self._kill()
            raise HostError(
                f"the host gave no answer to {what} within {self._timeout:g} s; an answer ends "
                "with a newline, and has to be flushed"
            ) from None
        if not raw.endswith(b"\n"):
            raise HostError(self._obituary(what, raw))
        try:
            answer = protocol.loads(raw)
        except PureLightError as error:
            raise HostError(f"the host's answer to {what} is {error}: {raw[:60]!r}") from error
        if answer.get("id") != self._count:
            raise HostError(f"the host's answer to {what} is that to another question")
        if "refused" in answer:
            raise RefusalError(_line(answer["refused"], 200))
        return answer

    def _exchange(self, line: bytes) -> bytes:
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        try:
            process.stdin.write(line)
            process.stdin.flush()
            return process.stdout.readline(protocol.LINE_BYTES)
        except OSError:
            return b""

    def _rest(self) -> bytes:
        """What the host still writes after the end of its input; only its beginning is kept."""
        assert self._process.stdout is not None
        rest = b""
        while piece := self._process.stdout.read(1 << 16):
            rest = rest or piece
        return rest

    def _obituary(self, what: str, raw: bytes) -> str:
        """Why there is no whole line: the host ended, or its line never does."""
        if len(raw) >= protocol.LINE_BYTES:
            return f"the host's answer to {what} has no end"
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(5.0)
        code = self._process.poll()
        self._errors.seek(0)
        words = [text.strip() for text in self._errors.read().decode(errors="replace").splitlines()]
        last = next((text for text in reversed(words) if text), "it said nothing")
        end = "closed its output" if code is None else f"ended with code {code}"
        return f"the host {end} at {what}: {_line(last, 200)}"

    def _kill(self) -> None:
        """Ends the host and what it started: a child may hold the pipes when the host has ended."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()


def _line(value: Any, length: int) -> str:
    """A host's words as one line, without what a terminal would obey."""
    return plain(" ".join(str(value).split()), length)
