"""Stages of a long job: each leaves a stamp when it is done, and a second run starts after it."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from purelight_format import atomic
from purelight_train.runs.progress import duration

Figures = dict[str, Any]
PRIOR = 60.0  # Seconds of trust in what stages are expected to take


@dataclass(frozen=True)
class Record:
    """What a finished stage leaves: its digest of inputs, its seconds, and its figures."""

    digest: str
    seconds: float
    figures: Figures


@dataclass(frozen=True)
class Stage:
    """One step of a job.

    Arguments:
        name: of its stamp; title: what the user reads.
        expected: seconds it takes on two CPU cores.
        settings: what its result depends on besides the stages before it.
        action: does the work, given the records of the stages before it, and returns figures for
            the report, as JSON has them.
        outputs: files that must exist for the stage to count as done.
    """

    name: str
    title: str
    expected: float
    settings: Figures
    action: Callable[[dict[str, Record]], Figures]
    outputs: tuple[Path, ...]


def run_stages(
    folder: Path, stages: Sequence[Stage], say: Callable[[str], None] = print
) -> dict[str, Record]:
    """Run the stages in order, each one only if its inputs have changed since its stamp.

    Arguments:
        folder: where the stamps are, in `.stages`.
        say: receives one line per event.
    """
    records: dict[str, Record] = {}
    digest, expected, taken = "", PRIOR, PRIOR
    for number, stage in enumerate(stages):
        digest = input_digest(digest, stage)
        left = taken / expected * sum(later.expected for later in stages[number:])
        head = f"[{number + 1}/{len(stages)}] {stage.title}"
        record = finished(folder, stage, digest)
        if record:
            say(f"{head}: done before, in {duration(record.seconds)}")
        else:
            say(f"{head} ... about {duration(left)} left in all")
            record = run_stage(folder, stage, digest, records)
            expected, taken = expected + stage.expected, taken + record.seconds
        records[stage.name] = record
    return records


def run_stage(folder: Path, stage: Stage, digest: str, done: dict[str, Record]) -> Record:
    """Do the work of one stage and stamp it."""
    stamp_path(folder, stage).unlink(missing_ok=True)
    start = time.perf_counter()
    figures = stage.action(done)
    record = Record(digest, time.perf_counter() - start, figures)
    path = stamp_path(folder, stage)
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(path, json.dumps(vars(record), indent=1).encode())
    return record


def finished(folder: Path, stage: Stage, digest: str) -> Record | None:
    """The stage's record if its stamp has this digest and its files are there."""
    try:
        record = Record(**json.loads(stamp_path(folder, stage).read_bytes()))
    except (OSError, ValueError, TypeError):
        return None
    if record.digest != digest or not all(path.exists() for path in stage.outputs):
        return None
    return record


def input_digest(before: str, stage: Stage) -> str:
    """SHA-256 over the digest of the stages before, the stage's name, and its settings."""
    inputs = json.dumps([before, stage.name, stage.settings], sort_keys=True)
    return hashlib.sha256(inputs.encode()).hexdigest()


def stamp_path(folder: Path, stage: Stage) -> Path:
    """Where the stage's stamp is."""
    return folder / ".stages" / f"{stage.name}.json"
