"""Lamps of the benchmark as jobs of Dask."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from benchmarks.systems import cluster
from benchmarks.systems.__main__ import main
from benchmarks.systems.records import Record, Records

ROOT = Path(__file__).parents[3]


def test_lamps_write_beside_each_other(tmp_path: Path) -> None:
    """Two who measure different lamps at once lose none of each other's records."""
    one, other = Records(tmp_path), Records(tmp_path)
    for k in range(3):
        one.add(Record("ball", "path", "room", "a", samples=2**k))
        other.add(Record("cube", "path", "room", "b", samples=2**k))
    found = Records(tmp_path)
    assert [(r.lamp, r.samples) for r in found.lines] == [
        (lamp, 2**k) for lamp in ("ball", "cube") for k in range(3)
    ]
    assert found.ended(("ball", "path", "room"), "a") is False


def test_jobs_say_why_they_failed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(ROOT)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    words = [f"--output={tmp_path}", "--scale=smoke", "--tasks", "no_such_task"]
    faults = cluster.run(["ball", "cube"], words, workers=2, address=None)
    assert set(faults) == {"ball", "cube"}
    assert all("no task no_such_task in this scale" in reason for reason in faults.values())
    assert "ball: " in capsys.readouterr().err


def test_a_scheduler_that_is_not_there_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from distributed import Client

    def refused(*_: object, **__: object) -> Client:
        raise OSError("connection refused")

    monkeypatch.setattr("distributed.Client", refused)
    assert main(["--output", str(tmp_path), "--scheduler", "tcp://127.0.0.1:1"]) == 2
    assert "no scheduler at tcp://127.0.0.1:1: connection refused" in capsys.readouterr().err


def test_without_dask_it_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("dask", "distributed"):
        monkeypatch.setitem(sys.modules, name, None)
    assert main(["--output", str(tmp_path), "--workers", "2"]) == 2
    assert "Dask is missing" in capsys.readouterr().err
