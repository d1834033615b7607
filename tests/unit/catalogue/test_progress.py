"""The line of progress: what is left is told by the jobs of each stage that have ended."""

from __future__ import annotations

import pytest

from purelight_catalogue.jobs import Job
from purelight_catalogue.progress import EXPECTED, Progress
from purelight_catalogue.work import Outcome
from purelight_train.runs.progress import duration


def jobs(count: int) -> list[Job]:
    """So many lamps, each to be trained and exported."""
    stages = ("train", "export")
    return [Job(s, f"{s} {n}", f"lamp-{n}", {}, {}) for n in range(count) for s in stages]


def said(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.splitlines()[-1]


def test_time_left_is_of_each_stage(capsys: pytest.CaptureFixture[str]) -> None:
    first, export, *_ = work = jobs(3)
    progress = Progress(work, workers=2)
    progress.ended(Outcome(first, fresh=True, seconds=600.0))  # twice what is expected
    left = (3 * 2 * EXPECTED["export"] + 2 * 600.0) / 2
    assert said(capsys) == f"[1/6] lamp-0: train: 10.0 min; about {duration(left)} left"
    progress.ended(Outcome(export, fresh=True, seconds=120.0))
    assert said(capsys) == f"[2/6] lamp-0: export: 2.0 min; about {duration(720)} left"


def test_a_failure_says_nothing_of_the_time(capsys: pytest.CaptureFixture[str]) -> None:
    first, second = jobs(1)
    progress = Progress([first, second], workers=1)
    progress.ended(Outcome(first, fault="no lamp", fresh=True, seconds=9000.0))
    assert said(capsys) == "[1/2] lamp-0: train: FAILED: no lamp; about 15 s left"
    progress.ended(Outcome(second, fault="not done"))
    assert capsys.readouterr().err == ""


def test_many_jobs_cost_no_more_each(capsys: pytest.CaptureFixture[str]) -> None:
    """Hours, if each job that ends were to look at all others."""
    work = jobs(20_000)
    progress = Progress(work, workers=64)
    for job in work:
        progress.ended(Outcome(job, fresh=True, seconds=60.0))
    assert said(capsys).startswith("[40000/40000] lamp-19999: export: 60 s; all done in ")
