"""Lamps side by side, each in a process of its own with a limit of time and memory."""

from __future__ import annotations

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from benchmarks.zoo.lamps.lamp import Lamp, make
from benchmarks.zoo.record import STAGES, Record, code_digest
from benchmarks.zoo.settings import settings
from purelight_format.errors import PureLightError

POLL = 0.5  # seconds
PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


@dataclass(frozen=True)
class Limits:
    """What one lamp may take: seconds, and bytes of memory where the system tells (Linux)."""

    seconds: float
    memory: float


@dataclass(frozen=True)
class Job:
    """A lamp of a zoo and what to do with it.

    Arguments:
        folder: of this lamp.
        preset: a name for `settings.settings`.
        stages: that are wanted.
    """

    lamp: Lamp
    folder: Path
    preset: str
    stages: tuple[str, ...]
    threads: int

    def prepare(self, again: list[str]) -> None:
        """Drop the results that `again` names; what was made of a training or bundle goes with it.

        Raises:
            PureLightError: the folder holds another lamp, or one with other settings.
        """
        record, key = Record.open(self.folder), self.key()
        if not record.key:
            record.key, record.lamp = key, self.lamp.description()
        if record.key != key:
            raise PureLightError(
                f"{self.folder}: was made with another preset or by another version of the zoo; "
                "choose another --output, or delete it"
            )
        if "train" in again:
            shutil.rmtree(self.folder / "run", ignore_errors=True)
        record.forget(again)
        for later, earlier in (("export", "train"), ("validate", "export")):
            if earlier not in record.stages:
                record.forget([later])
        if "export" not in record.stages:
            record.forget(list(STAGES[STAGES.index("flux") :]))
        record.save()

    def key(self) -> str:
        """Of the lamp's files, written anew, and of the settings."""
        digest = hashlib.sha256(settings(self.preset).digest().encode())
        with tempfile.TemporaryDirectory() as folder:
            self.lamp.write(Path(folder))
            for file in sorted(p for p in Path(folder).rglob("*") if p.is_file()):
                digest.update(file.name.encode() + b"\0" + file.read_bytes())
        return digest.hexdigest()[:16]

    @property
    def missing(self) -> list[str]:
        """Stages that are wanted and have no result, none if the lamp was given up."""
        record = Record.open(self.folder)
        if record.stopped:
            return []
        return [s for s in self.stages if s not in record.stages]

    def start(self) -> subprocess.Popen[bytes]:
        """Begin; what the process says goes to `log.txt`."""
        environment = os.environ | {
            "OMP_NUM_THREADS": str(self.threads), "OMP_WAIT_POLICY": "PASSIVE",
        }  # fmt: skip
        words = [
            sys.executable, "-m", "benchmarks.zoo.worker", str(self.lamp.seed),
            str(self.lamp.index), str(self.folder), "--preset", self.preset,
            "--threads", str(self.threads), "--stages", *self.stages,
        ]  # fmt: skip
        with open(self.folder / "log.txt", "ab") as log:
            return subprocess.Popen(words, stdout=log, stderr=log, env=environment)


@dataclass
class Running:
    """A job that has begun."""

    job: Job
    process: subprocess.Popen[bytes]
    begun: float

    def check(self, limits: Limits) -> str | None:
        """Why the job has to end, or has ended badly; empty if it has ended well."""
        code = self.process.poll()
        if code is not None:
            if code < 0:
                return f"ended by {signal.Signals(-code).name}"
            return f"ended with code {code}, see log.txt" if code else ""
        if time.monotonic() - self.begun > limits.seconds:
            return self._kill(f"stopped after {limits.seconds:.0f} s")
        if resident(self.process.pid) > limits.memory:
            return self._kill(f"stopped at {limits.memory / 2**30:.1f} GiB of memory")
        return None

    def _kill(self, reason: str) -> str:
        self.process.kill()
        self.process.wait()
        return reason


def resident(pid: int) -> float:
    """Bytes of memory that a process holds; 0 where the system does not tell."""
    try:
        return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * PAGE
    except (OSError, IndexError, ValueError):
        return 0.0


def run(jobs: list[Job], limits: Limits, side_by_side: int) -> Iterator[Job]:
    """Run jobs, so many at a time; gives each when it has ended."""
    waiting, running = [job for job in jobs if job.missing], list[Running]()
    try:
        while waiting or running:
            while waiting and len(running) < side_by_side:
                job = waiting.pop(0)
                running.append(Running(job, job.start(), time.monotonic()))
            time.sleep(POLL)
            for one in list(running):
                reason = one.check(limits)
                if reason is None:
                    continue
                running.remove(one)
                if reason and not _give_up(one.job, reason, time.monotonic() - one.begun):
                    waiting.insert(0, one.job)  # the stages after the one that ended it
                else:
                    yield one.job
    finally:
        for one in running:  # interrupted
            one.process.kill()


def _give_up(job: Job, reason: str, seconds: float) -> bool:
    """Note that a stage ended its process; whether nothing is left to do for the lamp."""
    record = Record.open(job.folder)
    stage = record.running or next(iter(job.missing), "make")
    record.end(stage, {"seconds": round(seconds, 1), "code": code_digest(), "failed": reason})
    return not job.missing or reason.startswith("stopped after")


def jobs_of(
    output: Path, seed: int, indices: list[int], preset: str, stages: list[str], threads: int
) -> list[Job]:
    """The jobs of a zoo; lamp folders are OUTPUT/SEED/LAMP."""
    lamps = [make(seed, index) for index in indices]
    return [
        Job(lamp, output / str(seed) / lamp.name, preset, tuple(stages), threads) for lamp in lamps
    ]
