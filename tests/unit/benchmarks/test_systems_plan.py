"""The hours of a scale, by hand."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.systems.__main__ import main, systems
from benchmarks.systems.plan import examples, plan
from benchmarks.systems.records import Record, Records
from benchmarks.systems.scales import SCALES
from benchmarks.systems.tasks.truth import Truth
from purelight_train.truth.picture import Picture

LAMP = "frosted_globe"


def measured(output: Path) -> Path:
    """Systems of one lamp at `smoke`: 2 s to begin a series, 10 s of training that two share."""
    records = Records(output / "smoke")
    training = {"seconds": {"training": 10.0}}
    costs = {
        "path": {"seconds": 0.0}, "ies": {"seconds": 20.0}, "ncl": {"seconds": 50.0},
        "purelight_accurate": {"seconds": 12.0, "parts": training},
        "purelight_fast": {"seconds": 12.0, "parts": training},
        "purelight_draft": {"seconds": 300.0, "parts": training["seconds"]},
        "purelight_draft_fast": {"seconds": 300.0, "parts": training["seconds"]},
    }  # fmt: skip
    for system, cost in costs.items():
        for samples in (1, 2):
            records.add(
                Record(LAMP, system, "room", "k", samples=samples, seconds=1, warm_up=2,
                       cost=cost, last=samples == 2)
            )  # fmt: skip
    dark = np.zeros((2, 2, 3))
    for task, seconds in (("room", 10.0), ("view_side", 20.0)):
        truth = Truth(Picture(dark, (dark, dark), dark), np.ones((2, 2), bool), 1000, seconds)
        truth.save(output / "smoke" / LAMP / "truth" / f"{task}-0.npz")
    return output


def hours(text: str) -> list[float]:
    rows = [line.split("|") for line in text.splitlines() if line.startswith("| ")]
    return [float(row[2]) for row in rows[1:]]


def test_hours_are_limits_and_rates(tmp_path: Path) -> None:
    chosen = replace(
        SCALES["full"], lamps=("a", "b"), preset="tiny", paths=360_000, view_paths=180_000,
        views=("view_side",), observers=(), instances=(1,), limit=360,
    )  # fmt: skip
    assert examples(chosen) == examples(SCALES["smoke"])
    told = hours(plan(chosen, systems(["path", "ies"]), measured(tmp_path)))
    # `path` does three lit tasks, the view and the hall, `ies` all but the view: 7 judged series
    ready, lit, seen = (
        2 * (10 + 20) / 3600,
        2 * 3 * 360_000 * 0.01 / 3600,
        2 * 180_000 * 0.02 / 3600,
    )
    expected = [ready, lit, seen, 2 * 7 * 360 / 3600, 2 * 9 * 2 / 3600]
    np.testing.assert_allclose(told, [*expected, sum(expected)], atol=0.051)


def test_the_training_of_a_lamp_counts_once(tmp_path: Path) -> None:
    chosen = replace(SCALES["full"], lamps=("a",) * 60, preset="tiny")
    names = ["purelight_accurate", "purelight_fast", "ncl"]
    told = hours(plan(chosen, systems(names), measured(tmp_path)))
    assert told[0] == pytest.approx(60 * (10 + 2 + 2 + 50) / 3600, abs=0.051)


def test_a_system_with_a_preset_of_its_own_takes_no_longer(tmp_path: Path) -> None:
    chosen = replace(SCALES["full"], lamps=("a",) * 60)
    output = measured(tmp_path)
    alone, beside = (
        hours(plan(chosen, systems(names), output))[0]
        for names in (
            ["purelight_accurate"],
            ["purelight_accurate", "purelight_draft", "purelight_draft_fast"],
        )
    )
    assert beside - alone == pytest.approx(60 * 300 / 3600, abs=0.101)


def test_a_plan_needs_what_was_measured(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--output", str(tmp_path), "--scale", "full", "--plan"]) == 2
    assert "measure the scale small or smoke first" in capsys.readouterr().err
    words = ["--output", str(measured(tmp_path)), "--scale", "full", "--plan", "--lamps", "crystal"]
    assert main(words) == 2
    assert "nothing is measured of ptracer, bidirectional" in capsys.readouterr().err
    assert main([*words, "--systems", "path", "ies"]) == 0
    assert "making 1 lamps ready for 2 systems" in capsys.readouterr().out
    assert main([*words, "--tasks", "room"]) == 2
    assert "leave --tasks out" in capsys.readouterr().err
