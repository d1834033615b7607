"""One job done: its commands in processes of their own, their memory watched, the result kept."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from purelight_catalogue.jobs import Job
from purelight_catalogue.results import Results
from purelight_catalogue.stages import STAGES, Command, Place
from purelight_format.issues import plain

TRIES = 3
GIB = 1 << 30
ROOM = 1 << 28  # bytes of disk that a job must find free
LINE = 400


@dataclass(frozen=True)
class Outcome:
    """How a job ended.

    Arguments:
        fault: one line on why there is no result; empty if there is.
        fresh: whether it was done now, and not found.
        seconds, gibibytes: that it took, now or when it was done.
        tries: how often it was begun.
    """

    job: Job
    fault: str = ""
    fresh: bool = False
    seconds: float = 0.0
    gibibytes: float = 0.0
    tries: int = 0
    host: str = ""


@dataclass
class CommandError(Exception):
    """A command that ended badly.

    Arguments:
        reason: its last line.
        again: whether another try may help: it was killed, or the disk was full.
    """

    reason: str
    again: bool
    tail: list[str] = field(default_factory=list)


def perform(job: Job, folder: Path, logs: Path, threads: int, before: Sequence[Outcome]) -> Outcome:
    """Do a job unless its result is there.

    Arguments:
        folder: of the results; logs: of what commands print, a file for each lamp.
        before: how the jobs ended whose results it reads.
    """
    results = Results(folder)
    if done := results.done(job):
        return Outcome(job, "", False, done.seconds, done.gibibytes, 0, done.host)
    broken = next((outcome for outcome in before if outcome.fault), None)
    if broken:
        return Outcome(job, f"not done, since {broken.job.stage} failed")
    for attempt in range(1, TRIES + 1):
        try:
            return _attempt(job, results, logs, threads, attempt)
        except CommandError as failure:
            if not failure.again or attempt == TRIES:
                return Outcome(job, failure.reason, True, tries=attempt)
        except OSError as error:
            if attempt == TRIES:
                return Outcome(job, plain(f"{error.filename or folder}: {error.strerror}", LINE),
                               True, tries=attempt)  # fmt: skip
        time.sleep(attempt)
    raise AssertionError("every try returns or is the last")


def _attempt(job: Job, results: Results, logs: Path, threads: int, attempt: int) -> Outcome:
    start = time.monotonic()
    with results.attempt(job) as draft:
        if shutil.disk_usage(draft).free < ROOM:
            raise CommandError(f"less than {ROOM >> 20} MiB of disk left in {results.folder}", True)
        before = {role: results.path(_stage_of(results, key), key)
                  for role, key in job.before.items()}  # fmt: skip
        place = Place(draft, before, threads)
        peak = 0.0
        for command in STAGES[job.stage](job, place):
            peak = max(peak, _run(command, job, place, logs))
        done = results.keep(draft, job, time.monotonic() - start, round(peak, 3))
    return Outcome(job, "", True, done.seconds, done.gibibytes, attempt, done.host)


def _stage_of(results: Results, key: str) -> str:
    """The stage of a finished job, by its key."""
    for stage in STAGES:
        if results.record(stage, key):
            return stage
    raise CommandError("the result of the job before is gone; run the command again", False)


def _run(command: Command, job: Job, place: Place, logs: Path) -> float:
    """Run a command to its end; the GiB of memory that it had at most.

    Raises:
        CommandError: it ended badly.
    """
    logs.mkdir(parents=True, exist_ok=True)
    log, errors = logs / f"{job.lamp}.txt", place.folder / "errors.txt"
    with open(errors, "wb") as said, open(log, "ab") as journal:
        output = open(place.folder / command.output, "wb") if command.output else said  # noqa: SIM115
        with output:
            process = subprocess.Popen(
                _words(command), stdout=output, stderr=said, stdin=subprocess.DEVNULL,
                env=_environment(place.threads),
            )  # fmt: skip
            _, status, usage = os.wait4(process.pid, 0)
        process.returncode = code = os.waitstatus_to_exitcode(status)
        tail = _last_lines(errors)
        journal.write(f"\n{time.strftime('%F %T')} {job.title}: exit code {code}\n".encode())
        journal.write("\n".join(tail).encode() + b"\n")
    errors.unlink()
    if code:
        raise CommandError(_reason(code, tail, job), code < 0 or _disk_is_full(tail))
    return usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024) / GIB


def _words(command: Command) -> list[str]:
    here = [sys.executable, "-m", "purelight_catalogue.child", str(os.getpid())]
    return [*here, command.module, *command.words]


def _environment(threads: int) -> Mapping[str, str]:
    """Threads that sleep while they wait, and no more of them than the job has cores."""
    number = str(threads)
    return os.environ | {"OMP_NUM_THREADS": number, "OMP_WAIT_POLICY": "PASSIVE"}


def _last_lines(path: Path, count: int = 40, most: int = 1 << 16) -> list[str]:
    """The end of what a command said; a progress bar counts as its last state."""
    with open(path, "rb") as file:
        file.seek(max(0, path.stat().st_size - most))
        text = file.read().decode(errors="replace")
    return [plain(line.rsplit("\r", 1)[-1], LINE) for line in text.rstrip().split("\n")][-count:]


def _reason(code: int, tail: Sequence[str], job: Job) -> str:
    if code < 0:
        name = signal.Signals(-code).name
        return f"{job.stage} was ended by {name}" + (
            ": out of memory?" if name == "SIGKILL" else ""
        )
    errors = [line for line in tail if "error:" in line] or list(tail[-1:])
    return (
        plain(errors[-1].partition("error: ")[2] or errors[-1], LINE) if errors else f"code {code}"
    )


def _disk_is_full(tail: Sequence[str]) -> bool:
    return any("No space left" in line or "quota" in line.lower() for line in tail)
