"""The runner against hosts that crash, hang, lie or refuse; the protocol's own example."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from purelight_conformance import cli, protocol, runner
from purelight_conformance.client import HostError
from purelight_conformance.suite import Suite
from purelight_conformance.text import to_text
from purelight_format.errors import PureLightError
from purelight_onnx import conformance_host

BROKEN = Path(__file__).with_name("broken_host.py")
SPEC = Path(__file__).parents[2] / "spec/conformance.md"


@pytest.fixture(scope="module")
def frames(whole: Suite) -> Suite:
    return Suite(tuple(v for v in whole.sets if v.group in ("frames", "cap")), whole.bundles)


def broken(way: str) -> list[str]:
    return [sys.executable, str(BROKEN), way]


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("ends_badly", "ended with exit code 3 at the end of its input, not 0"),
        ("never_ends", "did not end within 5 s"),
        ("goodbye", "wrote more than its answers: b'so long, and thanks"),
    ],
)
def test_a_host_ends_well(way: str, words: str, frames: Suite) -> None:
    assert words in runner.run(frames, broken(way), timeout=5).fault
    assert not runner.run(frames, broken("refuses"), timeout=20).fault


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("crash", "ended with code 1 at frames/axes: segmentation fault, more or less"),
        ("garbage", "frames/axes is no JSON"),
        ("list", "no JSON object"),
        ("deep", "no JSON"),
        ("late", "another question"),
        ("no_arrays", "must be an object"),
        ("no_base64", "no array of the protocol"),
        ("wrong_size", "no array of the protocol"),
        ("negative_size", "no array of the protocol"),
        ("no_size", "no array of the protocol"),
        ("wrong_type", "type must be"),
    ],
)
def test_a_host_that_breaks_down_does_not_conform(way: str, words: str, frames: Suite) -> None:
    report = runner.run(frames, broken(way), timeout=20)
    assert words in report.fault
    assert "\n" not in report.fault
    assert not report.conforms
    assert report.fault in to_text(report)


def test_a_host_that_hangs_is_ended(frames: Suite) -> None:
    start = time.monotonic()
    report = runner.run(frames, broken("hang"), timeout=1.0)
    assert "no answer to frames/axes within 1 s" in report.fault
    assert time.monotonic() - start < 15


def test_a_child_that_outlives_its_host_is_ended_too(frames: Suite) -> None:
    start = time.monotonic()
    with pytest.raises(HostError, match=r"no answer to hello within 1 s.* flushed"):
        runner.run(frames, ["sh", "-c", "sleep 60 & read request"], timeout=1.0)
    assert time.monotonic() - start < 15


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (["/no/such/program"], "cannot start"),
        ("", "cannot start"),
        ("'", "cannot start"),
        (broken("dead"), "ended with code 3 at hello"),
        (broken("old"), "version '0.9'"),
        (broken("mute"), "does not list"),
        (broken("unwilling"), "refused hello: no time"),
    ],
)
def test_a_host_that_does_not_start_is_an_error(
    command: str | list[str], words: str, frames: Suite
) -> None:
    with pytest.raises(HostError, match=re.escape(words)) as caught:
        runner.run(frames, command, timeout=20)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("way", "words"),
    [
        ("wrong_shape", "tangent has shape (1, 3), not (64, 3)"),
        ("too_little", "tangent is missing"),
        ("refuses", "was refused: not today"),
    ],
)
def test_a_wrong_answer_fails_the_whole_set(way: str, words: str, frames: Suite) -> None:
    report = runner.run(frames, broken(way), timeout=20)
    assert report.groups()["frames"]["failed"] == 64
    assert words in to_text(report)


def test_a_refusal_is_shown_in_one_line_and_moves_no_cursor(frames: Suite) -> None:
    report = runner.run(frames, broken("at_length"), timeout=20)
    assert report.failures[0].what == "was refused: not today, \\x1b[31mnor tomorrow"


def test_a_bug_that_only_a_newer_suite_hunts_is_named(frames: Suite) -> None:
    newer = tuple(replace(v, flags={"NEWER": [0]}) for v in frames.sets[:1])
    report = runner.run(Suite(newer, {}), broken("refuses"), timeout=20)
    assert "NEWER" in to_text(report)


@pytest.mark.parametrize("timeout", ["0", "-1", "nan", "inf", "1e300"])
def test_a_timeout_that_no_clock_knows_is_one_line(
    timeout: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["--suite", str(folder), "--timeout", timeout]
    assert cli.main(["run", "--host", "true", *arguments]) == 2
    error = capsys.readouterr().err
    assert "--timeout" in error
    assert error.count("\n") == 1


def test_what_a_host_does_not_offer_is_shown_as_skipped(frames: Suite) -> None:
    report = runner.run(frames, broken("refuses"), timeout=20)
    cap = report.groups()["cap"]
    assert cap["skipped"] == sum(cap.values()) > 0
    assert "the host does not offer: cap, " in to_text(report)


@pytest.mark.parametrize(
    ("host", "code"),
    [("/no/such/program", 2), (" ".join(broken("refuses")), 1), (" ".join(broken("crash")), 1)],
)
def test_exit_codes(host: str, code: int, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["run", "--host", host, "--suite", str(folder), "--json"]) == code
    printed = capsys.readouterr()
    if code == 2:
        assert printed.err.count("\n") == 1
    else:
        report = json.loads(printed.out)
        assert report["conforms"] is False
        assert bool(report["fault"]) == ("crash" in host)


def test_a_missing_suite_or_bundle_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = str(tmp_path / "missing")
    for arguments in (["--suite", missing], [missing]):
        assert cli.main(["run", "--host", "true", *arguments]) == 2
        error = capsys.readouterr().err
        assert missing in error
        assert error.count("\n") == 1


def test_the_example_of_the_specification_is_answered() -> None:
    text = SPEC.read_text().split("For example")[1].split("## The suite")[0]
    lines = "".join(re.findall(r"^    (.*\n)", text, re.M)).replace("},\n", "}, ")
    first, greeting, request, answer = (
        json.loads(line) for line in re.sub(r"\{\},\s+|,\n ", lambda m: m[0].strip() + " ", lines)
        .splitlines()
    )  # fmt: skip
    host = [sys.executable, "-m", "purelight_onnx.conformance_host"]
    wrong = {"id": 8, "do": "evaluate", "operation": protocol.READER}, {"id": 9, "do": "x"}
    sent = b"".join(map(protocol.dumps, (first, request, *wrong)))
    result = subprocess.run(host, input=sent, capture_output=True, check=True, timeout=60)
    hello, frame, reader, unknown = map(json.loads, result.stdout.splitlines())
    assert hello.keys() == greeting.keys()
    assert "frame" in hello["operations"]
    wanted, given = protocol.decode(answer["outputs"]), protocol.decode(frame["outputs"])
    for name in ("tangent", "bitangent"):
        np.testing.assert_array_equal(given[name], wanted[name])
    assert "nothing to evaluate" in reader["refused"]
    assert "x" in unknown["refused"]


def test_a_malformed_request_is_refused_and_later_ones_are_answered() -> None:
    host = [sys.executable, "-m", "purelight_onnx.conformance_host"]
    axis = protocol.encode({"axis": np.eye(3)[:1]})
    cap = protocol.encode({"point": np.eye(3)[:1]})
    evaluate: dict[str, object] = {
        "do": "evaluate", "operation": "cap", "parameters": {}, "inputs": cap,
    }  # fmt: skip
    malformed: list[dict[str, object]] = [
        {"do": "hello", "protocol": "2.0"},
        {"do": "open"},
        {"do": "evaluate"},
        evaluate,
        {**evaluate, "parameters": {"bounding_sphere": {"center": [0, 0], "radius": 1}}},
        {**evaluate, "parameters": {"bounding_sphere": {"center": [0, 0, 0], "radius": 0}}},
        {**evaluate, "inputs": {}},
        {**evaluate, "operation": "instance_radiance", "parameters": {"dimmer": -1}},
        {**evaluate, "operation": "frame", "inputs": axis | cap},
    ]
    good: dict[str, object] = {**evaluate, "operation": "frame", "inputs": axis}
    sent = b"".join(protocol.dumps({"id": k, **r}) for k, r in enumerate([*malformed, good]))
    result = subprocess.run(host, input=sent, capture_output=True, check=True, timeout=60)
    *refused, last = map(json.loads, result.stdout.splitlines())
    assert [answer["id"] for answer in refused] == list(range(len(malformed)))
    assert all("\n" not in answer["refused"] for answer in refused)
    assert "outputs" in last


@pytest.mark.parametrize("line", [b"hello\n", b"[1]\n", b"\n"])
def test_a_request_that_is_no_message_ends_a_host_with_one_line(line: bytes) -> None:
    host = [sys.executable, "-m", "purelight_onnx.conformance_host"]
    result = subprocess.run(host, input=line, capture_output=True, check=False, timeout=60)
    assert (result.returncode, result.stdout) == (2, b"")
    assert result.stderr.count(b"\n") == 1
    assert b"no JSON" in result.stderr


@pytest.mark.parametrize("dimmer", [-1, float("nan"), float("inf")])
def test_a_dimmer_that_is_none_is_refused(dimmer: float) -> None:
    with pytest.raises(PureLightError, match="dimmer must be"):
        conformance_host._dimmer({"dimmer": dimmer})


def test_arrays_survive_the_protocol() -> None:
    arrays = {"a": np.arange(6, dtype=np.float32).reshape(2, 3), "b": np.zeros((0, 16, 16, 3))}
    again = protocol.decode(json.loads(protocol.dumps(protocol.encode(arrays))))
    for name, array in arrays.items():
        np.testing.assert_array_equal(again[name], array)
        assert again[name].dtype == array.dtype
    with pytest.raises(PureLightError):
        protocol.decode({"a": {"dtype": "<f4", "shape": [-1], "data": "AAAA"}})
