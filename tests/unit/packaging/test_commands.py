"""What every command has in common: faults of one line, and quiet ends."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from purelight_format import command
from purelight_format.errors import PureLightError

ROOT = Path(__file__).parents[3]
SCRIPT = re.compile(r'^(purelight-\w+) = "(.+)"$', re.MULTILINE)
COMMANDS = dict(SCRIPT.findall((ROOT / "pyproject.toml").read_text()))
START = "import sys; from importlib import import_module; name, function = sys.argv[1].split(':')"
RUN = "sys.exit(getattr(import_module(name), function)(sys.argv[2:]))"
LARGE = {"torch", "trimesh", "scipy", "pxr", "onnx"}
LOADED = "import sys; __import__(sys.argv[1]); print(*sys.modules)"


def fault(name: str, *arguments: str, capsys: pytest.CaptureFixture[str]) -> str:
    """The line that a command prints about its arguments."""
    module, function = COMMANDS[name].split(":")
    with pytest.raises(SystemExit) as caught:
        getattr(importlib.import_module(module), function)(list(arguments))
    assert caught.value.code == 2
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    assert line.startswith(name)
    return line


@pytest.mark.parametrize("name", COMMANDS)
def test_wrong_arguments_are_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = fault(name, "run", "--nothing=1", capsys=capsys)
    assert re.search("--nothing|required", line)
    assert line.endswith("--help")


@pytest.mark.parametrize("name", COMMANDS)
def test_help_and_faults_wait_for_no_large_library(name: str) -> None:
    words = (sys.executable, "-c", LOADED, COMMANDS[name].split(":")[0])
    loaded = subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()
    assert "purelight_format.command" in loaded
    assert sorted(LARGE.intersection(loaded)) == []


@pytest.mark.parametrize("name", ["purelight-train", "purelight-demo"])
def test_choices_are_named(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    line = fault(name, "lamp.xml", "--preset", "quick", capsys=capsys)
    assert all(word in line for word in ("quick", "draft", "standard", "paper"))


def test_a_number_out_of_range(capsys: pytest.CaptureFixture[str]) -> None:
    for wrong in ("1", "x", "nan"):
        line = fault("purelight-size", "a", "--output=b", f"--target-error={wrong}", capsys=capsys)
        assert f"{wrong}: give a number between 0 and 1" in line


def test_a_line_break_in_an_argument_stays_in_the_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert "a\\nb" in fault("purelight-train", "lamp.xml", "--preset", "a\nb", capsys=capsys)


def closed(name: str, *arguments: str, unbuffered: bool = False) -> tuple[int, str]:
    """Exit code and error output of a command whose output nobody reads."""
    reader, writer = os.pipe()
    os.close(reader)
    environment = os.environ | {"PYTHONUNBUFFERED": "1" if unbuffered else ""}
    try:
        done = subprocess.run(
            [sys.executable, "-c", f"{START}; {RUN}", COMMANDS[name], *arguments], env=environment,
            stdout=writer, stderr=subprocess.PIPE, text=True, timeout=120, check=False,
        )  # fmt: skip
    finally:
        os.close(writer)
    return done.returncode, done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_ends_quietly_when_nobody_reads(name: str) -> None:
    assert closed(name, "--help") == (command.PIPE_CLOSED, "")


@pytest.mark.parametrize("unbuffered", [False, True])
@pytest.mark.parametrize("name", ["purelight-inspect", "purelight-validate"])
def test_so_does_one_in_the_middle_of_its_work(name: str, unbuffered: bool) -> None:
    path = str(ROOT / "spec" / "example.plux")
    assert closed(name, path, unbuffered=unbuffered) == (command.PIPE_CLOSED, "")


def test_closed_error_output_is_no_fault_either() -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-c", f"{START}; {RUN}", COMMANDS["purelight-inspect"], "nowhere.plux"],
        stdout=subprocess.PIPE, stderr=writer, timeout=120, check=False,
    )  # fmt: skip
    os.close(writer)
    assert (done.returncode, done.stdout) == (command.PIPE_CLOSED, b"")


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (PureLightError("no lamp\nhere"), "no lamp\\nhere"),
        (FileNotFoundError(2, "No such file or directory", "a.bin"), "a.bin: No such file"),
        (OSError("out of everything"), "out of everything"),
    ],
)
def test_faults_are_one_line(
    error: Exception, text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    def act() -> int:
        raise error

    assert command.run("purelight-test", act) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"purelight-test: error: {text}")


def test_other_errors_are_not_hidden() -> None:
    with pytest.raises(ZeroDivisionError):
        command.run("purelight-test", lambda: 1 // 0)
    assert command.run("purelight-test", lambda: 1) == 1
