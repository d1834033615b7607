"""Jobs on Dask: they are done, and a worker that is killed loses nothing."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from distributed import Client

import purelight_catalogue.engine
from purelight_catalogue.engine import engine, run
from purelight_catalogue.jobs import Job
from purelight_catalogue.results import Results
from purelight_format.errors import PureLightError

Exported = tuple[Results, dict[str, list[Job]]]


class Scheduler(NamedTuple):
    """A scheduler of Dask in a process of its own, with a worker."""

    address: str
    process: subprocess.Popen[bytes]


@pytest.fixture
def scheduler(tmp_path: Path) -> Iterator[Scheduler]:
    file = tmp_path / "scheduler.json"
    where = ["--scheduler-file", str(file)]
    dask = [sys.executable, "-m", "dask"]
    quiet = ["--no-dashboard", "--host", "127.0.0.1", *where]
    alone = ["--no-nanny", "--nthreads", "1", "--memory-limit", "0", "--resources", "GIB=8"]
    with (
        subprocess.Popen([*dask, "scheduler", *quiet, "--port", "0"]) as first,
        subprocess.Popen([*dask, "worker", *quiet, *alone]) as worker,
    ):
        try:
            with Client(scheduler_file=str(file), timeout=60) as client:
                client.wait_for_workers(1, timeout=60)
                address = client.scheduler.address
            yield Scheduler(address, first)
        finally:
            first.kill()
            worker.kill()


def all_jobs(work: dict[str, list[Job]]) -> list[Job]:
    return [job for jobs in work.values() for job in jobs]


def test_a_killed_worker_loses_nothing(exported: Exported, tmp_path: Path) -> None:
    results, work = exported
    jobs = all_jobs(work)
    with engine(2, None) as client:
        pids = list(client.run(os.getpid).values())
        killer = threading.Timer(0.5, os.kill, (pids[0], signal.SIGKILL))
        killer.start()
        outcomes = list(run(client, jobs, results.folder, tmp_path / "logs"))
        killer.join()
    assert [outcome.fault for outcome in outcomes] == [""] * len(jobs)
    assert {outcome.job.key for outcome in outcomes} == {job.key for job in jobs}
    assert all(results.done(job) for job in jobs)
    assert not any(
        outcome.fresh for outcome in outcomes if outcome.job.stage in ("train", "export")
    )


def test_what_dask_lets_go_of_is_asked_for_again(exported: Exported, tmp_path: Path) -> None:
    """As it does with a worker's results that are asked for while the worker dies."""
    results, work = exported
    jobs = all_jobs(work)
    with engine(1, None) as client:
        outcomes = run(client, jobs, results.folder, tmp_path / "logs")
        ended = [next(outcomes)]
        client.cancel(list(client.futures.values()), force=True)
        ended += outcomes
    assert [outcome.fault for outcome in ended] == [""] * len(jobs)
    assert {outcome.job.key for outcome in ended} == {job.key for job in jobs}


def test_a_lost_scheduler_is_one_line(
    exported: Exported, scheduler: Scheduler, tmp_path: Path
) -> None:
    results, work = exported
    with engine(1, scheduler.address) as client:
        outcomes = run(client, all_jobs(work), results.folder, tmp_path / "logs")
        next(outcomes)
        scheduler.process.kill()
        with pytest.raises(PureLightError, match="the scheduler is lost; start it again"):
            list(outcomes)


def test_who_begins_again_asks_for_what_is_missing_alone(
    exported: Exported, tmp_path: Path
) -> None:
    """Their jobs before, and those before these, are finished and not among them."""
    results, work = exported
    missing = [job for job in work["desk"] if job.stage == "check"]
    with engine(1, None) as client:
        (outcome,) = run(client, missing, results.folder, tmp_path / "logs")
    assert outcome.fault == ""
    assert results.done(missing[0])


def test_a_job_too_large_for_any_worker_is_one_line(exported: Exported, tmp_path: Path) -> None:
    results, work = exported
    job = work["desk"][0]
    huge = Job(job.stage, "f" * 64, job.lamp, job.arguments, {}, gibibytes=1e6)
    with engine(1, None) as client, pytest.raises(PureLightError, match="needs 1e\\+06 GiB"):
        list(run(client, [huge], results.folder, tmp_path))


def test_nobody_at_the_address_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(purelight_catalogue.engine, "PATIENCE", "1s")
    with pytest.raises(PureLightError, match="no scheduler at"), engine(1, "tcp://127.0.0.1:9"):
        pass
