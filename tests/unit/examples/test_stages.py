"""Stages: done once, done again only after a change, and never half done."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_examples.stages import Figures, Record, Stage, duration, run_stages


class Job:
    """Two stages that count how often they run."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.runs, self.lines = folder, [], []
        self.fails = False

    def first(self, done: dict[str, Record]) -> Figures:
        self.runs.append("first")
        (self.folder / "a").write_text("a")
        return {"answer": 42}

    def second(self, done: dict[str, Record]) -> Figures:
        self.runs.append("second")
        if self.fails:
            raise ValueError("no")
        return {"twice": 2 * done["first"].figures["answer"]}

    def __call__(self, **settings: int) -> dict[str, Record]:
        stages = [
            Stage("first", "First", 1, settings, self.first, (self.folder / "a",)),
            Stage("second", "Second", 1, {}, self.second, ()),
        ]
        return run_stages(self.folder, stages, self.lines.append)


@pytest.fixture
def job(tmp_path: Path) -> Job:
    return Job(tmp_path)


def test_later_stages_see_the_figures_of_earlier_ones(job: Job) -> None:
    assert job()["second"].figures == {"twice": 84}


def test_a_second_run_does_nothing_again(job: Job) -> None:
    before = job(size=1)
    assert job(size=1) == before
    assert job.runs == ["first", "second"]
    assert "done before" in job.lines[-1]


def test_a_change_repeats_the_stage_and_all_after_it(job: Job) -> None:
    job(size=1)
    job(size=2)
    assert job.runs == ["first", "second"] * 2


def test_a_missing_file_repeats_its_stage(job: Job) -> None:
    job()
    (job.folder / "a").unlink()
    job()
    assert job.runs == ["first", "second", "first"]


def test_a_stage_that_failed_runs_again(job: Job) -> None:
    job.fails = True
    with pytest.raises(ValueError, match="no"):
        job()
    job.fails = False
    job()
    assert job.runs == ["first", "second", "second"]


def test_a_damaged_stamp_counts_as_none(job: Job) -> None:
    job()
    (job.folder / ".stages" / "second.json").write_text('{"digest": 3')
    job()
    assert job.runs == ["first", "second", "second"]


def test_duration() -> None:
    assert duration(42.4) == "42 s"
    assert duration(150) == "2.5 min"
