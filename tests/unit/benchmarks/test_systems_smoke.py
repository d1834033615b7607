"""The whole benchmark of systems at its smallest scale; minutes, so marked slow."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.systems.own.trained_by import TrainedBy
from benchmarks.systems.protocol import Cost
from benchmarks.systems.records import Records
from benchmarks.systems.runner import Runner
from benchmarks.systems.scales import scale

ROOT = Path(__file__).parents[3]
OWN = ("path", "ptracer", "purelight_accurate", "purelight_fast")


@pytest.mark.slow
def test_one_command_measures_and_reports(tmp_path: Path) -> None:
    words = ["--output", str(tmp_path), "--scale", "smoke", "--systems", *OWN]
    subprocess.run([sys.executable, "-m", "benchmarks.systems", *words], check=True, cwd=ROOT)
    records = Records(tmp_path / "smoke").current()
    assert not [r for r in records if r.failed]
    tasks = {task.name for task in scale("smoke").tasks("frosted_globe", 0.1)}
    assert {(r.system, r.task) for r in records} == {(s, t) for s in OWN for t in tasks}
    light = [r for r in records if (r.system, r.task) == ("ptracer", "room")][-1]
    assert abs(light.figures["mean"]) < 4 * light.figures["mean_noise"]
    report = tmp_path / "smoke/report"
    assert "not measured" in (report / "results.md").read_text()
    assert (report / "index.html").stat().st_size > 100_000


@pytest.mark.slow
def test_another_preset_is_trained_once(tmp_path: Path) -> None:
    system = TrainedBy("tiny")
    runner = Runner(tmp_path, scale("smoke"), [system], only=("room",))
    runner.run(["frosted_globe"])
    records = runner.records.current()
    assert {r.system for r in records if r.samples} == {"purelight_tiny"}
    assert not [r for r in records if r.failed]
    assert records[-1].figures["mape"] < 0.5
    cost = Cost(**records[-1].cost)
    assert cost.parts.keys() == {"training", "export"}
    assert cost.seconds == sum(cost.parts.values()) > 1
    written = tmp_path / "frosted_globe/systems/purelight_tiny/lamp.plux"
    before = written.stat().st_mtime_ns
    both = [system, TrainedBy("tiny", "fast")]
    later = Runner(tmp_path, scale("smoke"), both, only=("floor",))
    later.run(["frosted_globe"])
    assert not [r for r in later.records.current() if r.failed]
    assert {r.system for r in later.records.current() if r.task == "floor"} == {
        "purelight_tiny", "purelight_tiny_fast",
    }  # fmt: skip
    assert written.stat().st_mtime_ns == before
