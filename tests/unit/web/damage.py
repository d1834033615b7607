"""Damaged inputs of the fuzz targets with what Python says of them, for the page's reader."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable
from random import Random
from typing import Any

from purelight_format.issues import FormatError, Issue
from purelight_format.members import container, manifest, npy, strict_json
from purelight_format.networks.profile import inspect
from purelight_format.usd import layer
from purelight_format.validation.validate import examine
from tests.fuzz import targets

Issues = Iterable[Issue]
KEPT = 6  # Issues of a report.


def _container(data: bytes) -> Issues:
    container.scan(data)
    return ()


def _json(data: bytes) -> Issues:
    strict_json.loads(data, "test")
    return ()


def _npy(data: bytes) -> Issues:
    npy.loads(data, "test", "<f4")
    return ()


def _network(data: bytes) -> Issues:
    return inspect(data[1:], list(targets.models())[data[0]]).warnings


def _layer(data: bytes) -> Issues:
    return layer.check(data, targets.layer_name(), targets.good())


CHECKS: dict[str, tuple[Callable[[bytes], Issues], int]] = {
    "container": (_container, 600),
    "json": (_json, 600),
    "manifest": (lambda data: manifest.examine(data)[1], 300),
    "npy": (_npy, 600),
    "onnx_bytes": (_network, 500),
    "onnx_graph": (_network, 300),
    "layer": (_layer, 600),
    "bundle": (lambda data: examine(data).report.issues, 60),
}


def made() -> dict[str, Any]:
    """By target a list of inputs and of the issues that Python finds; names that checks need."""
    rng = Random(20)
    found = {
        name: [_described(targets.TARGETS[name].make(rng), check) for _ in range(count)]
        for name, (check, count) in CHECKS.items()
    }
    names = {"models": list(targets.models()), "layer": targets.layer_name()}
    return {"targets": found, **names, "members": list(targets.good())}


def _described(data: bytes, check: Callable[[bytes], Issues]) -> dict[str, Any]:
    try:
        issues = sorted(check(data), key=lambda issue: not issue.is_error)
    except FormatError as error:
        issues = [error.issue]
    lines = [f"{issue.code.name} {issue.location}: {issue.message}" for issue in issues[:KEPT]]
    return {"data": base64.b64encode(data).decode(), "issues": lines}
