"""Jobs done in processes of their own: kept whole, or told in one line."""

from __future__ import annotations

import os
import subprocess
import sys
from datetime import datetime, timezone
from pathlib import Path

import pytest

from purelight_catalogue import work
from purelight_catalogue.jobs import Job
from purelight_catalogue.results import Results
from purelight_catalogue.stages import STAGES, Command, Place
from purelight_catalogue.work import Outcome, perform

JOB = Job("probe", "ab" * 32, "desk", {}, {})
HELP = """
import os, pathlib, signal, sys
def main(words):
    kind, count = words[0], pathlib.Path(words[1])
    count.write_text(str(int(count.read_text() or 0) + 1) if count.exists() else "1")
    if kind == "fault":
        print("probe: error: the lamp is dark", file=sys.stderr)
        return 2
    if kind == "killed" and count.read_text() == "1":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "full":
        print("probe: error: x: cannot write: No space left on device", file=sys.stderr)
        return 2
    pathlib.Path(words[2], "made.txt").write_text("light")
    return 0
"""


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> object:
    """Performs a job of one command that ends in a given way; gives outcome and tries."""
    (tmp_path / "probe.py").write_text(HELP)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    monkeypatch.setattr(work.time, "sleep", lambda _: None)

    def perform_one(kind: str) -> tuple[Outcome, int]:
        count = tmp_path / f"count-{kind}"

        def stage(job: Job, place: Place) -> list[Command]:
            return [Command("probe", (kind, str(count), str(place.folder)))]

        monkeypatch.setitem(STAGES, "probe", stage)  # type: ignore[arg-type]
        outcome = perform(JOB, tmp_path / "results", tmp_path / "logs", 1, [])
        return outcome, int(count.read_text()) if count.exists() else 0

    return perform_one


def test_a_job_is_done_once(run, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    first, _ = run("well")
    again, tries = run("well")
    assert (first.fault, first.fresh, again.fresh, tries) == ("", True, False, 1)
    assert first.gibibytes > 0
    made = Results(tmp_path / "results").path("probe", JOB.key)
    assert (made / "made.txt").read_text() == "light"
    assert sorted(p.name for p in made.iterdir()) == ["job.json", "made.txt"]


def test_a_lamps_fault_is_its_line_and_is_not_tried_again(run, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    outcome, tries = run("fault")
    assert (outcome.fault, tries) == ("the lamp is dark", 1)
    assert list((tmp_path / "results").iterdir()) == []
    assert "the lamp is dark" in (tmp_path / "logs/desk.txt").read_text()


def test_a_killed_command_is_tried_again(run) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    outcome, tries = run("killed")
    assert (outcome.fault, tries, outcome.tries) == ("", 2, 2)


def test_a_full_disk_is_tried_again_and_then_told(run) -> None:  # type: ignore[no-untyped-def]  # noqa: ANN001
    outcome, tries = run("full")
    assert tries == work.TRIES
    assert "No space left" in outcome.fault


def test_no_job_begins_behind_one_that_failed(tmp_path: Path) -> None:
    broken = Outcome(Job("train", "0" * 64, "desk", {}, {}), "the lamp is dark", True)
    outcome = perform(JOB, tmp_path, tmp_path, 1, [broken])
    assert outcome.fault == "not done, since train failed"


def test_drafts_of_the_dead_are_swept_and_those_of_the_living_are_not(tmp_path: Path) -> None:
    results = Results(tmp_path)
    dead = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"],
                          capture_output=True, text=True, check=True)  # fmt: skip
    with results.attempt(JOB) as living:
        left = living.with_name(living.name.replace(f".{os.getpid()}.", f".{dead.stdout.strip()}."))
        left.mkdir()
        foreign = living.with_name(living.name.replace(".", ".another-machine.", 2)[1:])
        assert results.sweep() == 1
        assert living.exists()
        assert not left.exists()
        assert not foreign.exists()


def test_the_first_of_two_equal_jobs_gives_the_result(tmp_path: Path) -> None:
    results = Results(tmp_path)
    with results.attempt(JOB) as one, results.attempt(JOB) as other:
        (one / "who").write_text("one")
        (other / "who").write_text("other")
        first = results.keep(one, JOB, 1.0, 1.0)
        second = results.keep(other, JOB, 9.0, 9.0)
    assert first == second
    assert (results.path("probe", JOB.key) / "who").read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == [f"probe-{JOB.key[:16]}"]


def test_a_result_without_its_record_is_none(tmp_path: Path) -> None:
    results = Results(tmp_path)
    results.path("probe", JOB.key).mkdir(parents=True)
    assert results.done(JOB) is None
    with results.attempt(JOB) as draft:
        assert results.keep(draft, JOB, 1.0, 1.0).seconds == 1.0


def test_the_day_is_that_of_the_first_command(tmp_path: Path) -> None:
    results = Results(tmp_path / "results")
    first = results.begun()
    assert datetime.strptime(first, "%Y-%m-%d").date() <= datetime.now(timezone.utc).date()
    (results.folder / "begun-2026-01-31").touch()  # By another machine, which was earlier
    assert results.begun() == "2026-01-31"
    assert first != "2026-01-31"
