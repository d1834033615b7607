"""JSON lines between the runner and a host: messages, arrays, and the host's side of it."""

from __future__ import annotations

import base64
import binascii
import json
import os
import sys
from collections.abc import Mapping
from typing import Any, BinaryIO, Protocol

import numpy as np

from purelight_format.errors import PureLightError

VERSION = "1.0"
READER = "reader"  # Offered by hosts that vet what they open; there is nothing to evaluate.
LINE_BYTES = 256 << 20  # More than any answer needs; what is longer is not read to its end.
DTYPES = ("<f4", "<f8")

MALFORMED = (ArithmeticError, LookupError, TypeError, ValueError)  # By parameters and inputs.

Arrays = dict[str, np.ndarray]


class MessageError(PureLightError):
    """A line is no message."""


class Host(Protocol):
    """What a host written in Python supplies; every refusal is a `PureLightError`.

    Attributes:
        name, version: of the host, for people.
        operations: what it can be asked for, keys of `operations.OPERATIONS`, and READER.
    """

    name: str
    version: str
    operations: tuple[str, ...]

    def open(self, path: str) -> None:
        """Opens a bundle in place of the one before."""

    def evaluate(self, operation: str, parameters: Mapping[str, Any], inputs: Arrays) -> Arrays:
        """Evaluates rows [N, ...]."""


def encode(arrays: Mapping[str, np.ndarray]) -> dict[str, dict[str, Any]]:
    """Arrays as JSON values: type, shape, and the bytes in base64."""
    return {name: _encode(np.asarray(array)) for name, array in arrays.items()}


def _encode(array: np.ndarray) -> dict[str, Any]:
    dtype = "<f8" if array.dtype == np.float64 else "<f4"
    raw = np.ascontiguousarray(array, dtype).tobytes()
    return {"dtype": dtype, "shape": list(array.shape), "data": base64.b64encode(raw).decode()}


def decode(value: Any) -> Arrays:
    """Arrays from JSON values.

    Raises:
        PureLightError: If they are none.
    """
    if not isinstance(value, dict):
        raise PureLightError("arrays must be an object")
    return {str(name): _decode(str(name), array) for name, array in value.items()}


def _decode(name: str, value: Any) -> np.ndarray:
    try:
        dtype, shape, data = value["dtype"], value["shape"], value["data"]
        if dtype not in DTYPES:
            raise PureLightError(f"{name}: the type must be {' or '.join(DTYPES)}")
        if not all(type(size) is int and size >= 0 for size in shape):  # NumPy would guess for -1.
            raise ValueError("sizes are whole numbers, not below 0")
        raw = base64.b64decode(data, validate=True)
        return np.frombuffer(raw, dtype).reshape(shape)
    except (TypeError, KeyError, ValueError, binascii.Error) as error:
        raise PureLightError(f"{name}: no array of the protocol ({error!r})") from error


def dumps(message: Mapping[str, Any]) -> bytes:
    """One message as one line."""
    return json.dumps(message, allow_nan=False).encode() + b"\n"


def loads(line: bytes) -> dict[str, Any]:
    """One line as one message.

    Raises:
        MessageError: If it is none.
    """
    try:
        message = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise MessageError("no JSON") from error
    if not isinstance(message, dict):
        raise MessageError("no JSON object")
    return message


def serve(host: Host) -> int:
    """Answers the runner until it closes the pipe; returns the exit code: 0, or 2 after one line
    about a request that is no message.

    Whatever else the process prints goes to its standard error, so that no library can spoil the
    answers.
    """
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    try:
        with answers:
            _answer_all(host, sys.stdin.buffer, answers)
    except MessageError as error:
        print(f"{host.name}: error: a request is {error}", file=sys.stderr)
        return 2
    return 0


def _answer_all(host: Host, requests: BinaryIO, answers: BinaryIO) -> None:
    for line in requests:
        request = loads(line)
        try:
            answer = _answer(host, request)
        except PureLightError as error:
            answer = {"refused": " ".join(str(error).split())}
        except MALFORMED as error:
            answer = {"refused": f"the request is not of the protocol: {error!r}"[:500]}
        answers.write(dumps({"id": request.get("id"), **answer}))
        answers.flush()


def _answer(host: Host, request: Mapping[str, Any]) -> dict[str, Any]:
    task = request.get("do")
    if task == "hello":
        if (version := str(request.get("protocol"))).split(".")[0] != VERSION.split(".")[0]:
            raise PureLightError(f"version {version} of the protocol is not spoken here")
        return {"protocol": VERSION, "host": host.name, "version": host.version,
                "operations": list(host.operations)}  # fmt: skip
    if task == "open":
        host.open(request["bundle"])
        return {}
    if task == "evaluate":
        if request["operation"] not in host.operations or request["operation"] == READER:
            raise PureLightError(f"{request['operation']} is nothing to evaluate here")
        outputs = host.evaluate(
            request["operation"], request["parameters"], decode(request["inputs"])
        )
        return {"outputs": encode(outputs)}
    raise PureLightError(f"cannot do {task!r}")
