"""Damaged inputs of every target: a few here, millions by `python -m tests.fuzz`."""

from __future__ import annotations

import math
import time
from pathlib import Path

import pytest

from tests.fuzz import harness, targets
from tests.fuzz.targets import TARGETS, Target

QUICK = {"container": 20_000, "json": 6_000, "manifest": 1_500, "npy": 20_000, "onnx_bytes": 6_000,
         "onnx_graph": 1_500, "onnx_drawn": 800,
         "onnx_heavy": 300, "onnx_compiled": 300, "layer": 4_000, "layer_usd": 800,
         "bundle": 300}  # fmt: skip
HOUR = 3600


@pytest.mark.parametrize("name", TARGETS)
def test_damaged_inputs_are_refused_or_keep_their_property(name: str) -> None:
    tally = harness.try_inputs(name, 0, QUICK[name], math.inf)
    assert tally.findings == []
    assert tally.inputs == QUICK[name]
    assert 0 < tally.accepted < tally.inputs


@pytest.mark.slow
@pytest.mark.parametrize("name", TARGETS)
def test_an_hour_of_damaged_inputs(name: str, tmp_path: Path) -> None:
    seed = time.time_ns() // 10**9  # Other inputs each time; a finding names its own.
    tally = harness.run(name, 1 << 31, HOUR / len(TARGETS), seed=seed)
    harness.save(tally.findings, tmp_path)
    assert tally.findings == []
    assert tally.inputs > QUICK[name]


def crash(data: bytes) -> bool:
    import os

    os._exit(3)


def wait(data: bytes) -> bool:
    time.sleep(60)
    return True


def hang(data: bytes) -> bool:
    while True:
        pass


def raise_another_error(data: bytes) -> bool:
    raise ZeroDivisionError


@pytest.mark.parametrize(
    ("check", "what"),
    [
        (crash, "ended with 3"),
        (hang, "no answer"),
        (wait, "no answer"),
        (raise_another_error, "ZeroDivisionError"),
    ],
)
def test_the_harness_finds_crashes_hangs_and_foreign_exceptions(
    check: object, what: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    target = Target(targets.make_json, check, 1.0)  # type: ignore[arg-type]
    monkeypatch.setitem(TARGETS, "json", target)
    monkeypatch.setattr(harness, "HANG", 1.0)
    monkeypatch.setattr(harness, "IDLE", 5.0 if check is wait else 300.0)
    tally = harness.run("json", 3, 30, processes=1, method="fork")
    assert what in tally.findings[0]["what"]
    harness.save(tally.findings, tmp_path)
    number = tally.findings[0]["number"]
    assert (tmp_path / f"json-{number}").read_bytes() == harness.data_of("json", number)
