"""Lamps x systems x tasks, one after the other; what is measured already is not done again."""

from __future__ import annotations

import hashlib
import io
import shutil
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from benchmarks.systems import errors, isolated, subjects
from benchmarks.systems.own.trained_by import TrainedBy
from benchmarks.systems.protocol import Cost, Frame, Subject, System
from benchmarks.systems.records import Record, Records, plain
from benchmarks.systems.scales import Scale
from benchmarks.systems.source import source_digest
from benchmarks.systems.subjects import Facts
from benchmarks.systems.tasks.task import JudgedTask
from benchmarks.systems.tasks.truth import Truth
from benchmarks.zoo.record import code_digest
from purelight_format import atomic
from purelight_format.errors import PureLightError

SEED = 1  # of every series


@dataclass
class Runner:
    """A run of the benchmark in a folder.

    Arguments:
        only: names of tasks; all if empty.
        again: names of systems, tasks, or `failed`: what to measure once more.
    """

    folder: Path
    scale: Scale
    systems: Iterable[System]
    threads: int = 1
    only: tuple[str, ...] = ()
    again: tuple[str, ...] = ()
    records: Records = field(init=False)

    def __post_init__(self) -> None:
        self.records = Records(self.folder)

    @cached_property
    def code(self) -> str:
        return code_digest()

    def run(self, lamps: Iterable[str]) -> None:
        """Measure all lamps; one that fails costs its own cells alone."""
        for name in lamps:
            try:
                self._say(name, "making the lamp ready")
                facts = subjects.subject(name, self.folder / name, self.scale.preset, self.threads)
            except PureLightError as error:
                self._say(name, f"failed: {error}")
                self.records.add(Record(name, "", "", "lamp", self.code, failed=str(error)))
                continue
            if any(r.series == (name, "", "") for r in self.records.current()):
                self.records.add(Record(name, "", "", "lamp", self.code))
            self._lamp(facts)

    def _lamp(self, facts: Facts) -> None:
        tasks = self._tasks(facts)
        for system in self.systems:
            wanted = [t for t in tasks if t.kind in system.answers]
            missing = [t for t in wanted if self._missing(facts, system, t)]
            if missing:
                self._system(facts, system, missing)

    def _tasks(self, facts: Facts) -> list[JudgedTask]:
        tasks = self.scale.tasks(facts.subject.name, facts.aperture)
        return [task for task in tasks if not self.only or task.name in self.only]

    def _missing(self, facts: Facts, system: System, task: JudgedTask) -> bool:
        series, key = (facts.subject.name, system.name, task.name), self.key(facts, system, task)
        failed = any(r.series == series and r.failed for r in self.records.current())
        again = {system.name, task.name} & set(self.again) or ("failed" in self.again and failed)
        return bool(again) or not self.records.ended(series, key)

    def key(self, facts: Facts, system: System, task: JudgedTask) -> str:
        """A word that changes with all that a series depends on but the code that all share."""
        words = (
            facts.digest, source_digest(task), repr(task), self.scale.paths_of(task),
            self._samples(task), SEED, self.threads, system.name, source_digest(system),
            *([subjects.ALL_PRESETS[system.preset]] if isinstance(system, TrainedBy) else []),
        )  # fmt: skip
        return hashlib.sha256(repr(words).encode()).hexdigest()[:16]

    def _samples(self, task: JudgedTask) -> list[int]:
        return list(self.scale.samples if task.measured else self.scale.samples[:3])

    def _system(self, facts: Facts, system: System, tasks: list[JudgedTask]) -> None:
        folder = self.folder / facts.subject.name / "systems" / system.name
        _of_this_lamp(folder, facts.digest)
        cost, trouble = Cost(0, 0), ""
        try:
            self._say(facts.subject.name, system.name, "preparing")
            cost = next(isolated.results(prepared, system, facts.subject, folder))
        except PureLightError as error:
            trouble = str(error)
        for task in tasks:
            try:
                if trouble:
                    raise PureLightError(trouble)
                self._series(facts, system, task, cost, folder)
            except Exception as error:  # a system of others: its own cells alone are lost
                reason = str(error) if isinstance(error, PureLightError) else repr(error)
                self._say(facts.subject.name, system.name, task.name, f"failed: {reason}")
                lines = " ".join(reason.split()) or type(error).__name__
                self.records.add(
                    Record(
                        *(facts.subject.name, system.name, task.name),
                        self.key(facts, system, task), self.code, task.kind, cost=asdict(cost),
                        last=True, failed=lines, threads=self.threads,
                    )
                )  # fmt: skip

    def _series(
        self, facts: Facts, system: System, task: JudgedTask, cost: Cost, folder: Path
    ) -> None:
        truth = self._truth(facts, task) if task.measured else None
        subject, key = facts.subject, self.key(facts, system, task)
        frames = system.frames(subject, task, folder, self._samples(task), SEED)
        for earlier, frame, last in pairs(frames, self.scale.limit, self.threads):
            figures = {}
            if truth is not None:
                seen = errors.picture(earlier, frame)
                figures = plain(errors.measure(subject, task, seen, truth))
            seconds = spent(frame, self.threads)
            record = Record(
                subject.name, system.name, task.name, key, self.code, task.kind, frame.samples,
                seconds, frame.seconds, frame.warm_up, frame.megabytes, plain(asdict(cost)),
                figures, self._keep(subject, system, task, frame), last, threads=self.threads,
            )  # fmt: skip
            self.records.add(record)
            self._say(*record.series, f"{frame.samples} spp, {seconds:.2f} s", _told(record))

    def _keep(self, subject: Subject, system: System, task: JudgedTask, frame: Frame) -> str:
        name = f"{subject.name}/frames/{system.name}-{task.name}-{frame.samples}.npz"
        buffer = io.BytesIO()
        np.savez_compressed(buffer, image=frame.image.astype(np.float32))
        (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(self.folder / name, buffer.getvalue())
        return name

    def _truth(self, facts: Facts, task: JudgedTask) -> Truth:
        """A task's truth; those of other tasks that lack it and share its light are made too."""
        path, paths = self._truth_file(facts, task), self.scale.paths_of(task)
        if not path.is_file():
            lacking = {
                t.name: t for t in self._tasks(facts)
                if t.measured and self.scale.paths_of(t) == paths
                and not self._truth_file(facts, t).is_file()
            }  # fmt: skip
            self._say(facts.subject.name, task.name, "light tracing the truth")
            words = (traced, task, [*lacking.values()], facts.subject, path.parent, paths)
            for name, truth in isolated.results(*words):
                file = self._truth_file(facts, lacking[name])
                truth.save(file)
                atomic.write_bytes(file.with_name(f"{name}.txt"), file.name.encode())
        return Truth.load(path)

    def _truth_file(self, facts: Facts, task: JudgedTask) -> Path:
        """Where a truth is kept, by a digest of what it depends on."""
        words = repr((facts.digest, source_digest(task), repr(task), self.scale.paths_of(task)))
        digest = hashlib.sha256(words.encode()).hexdigest()[:12]
        return self.folder / facts.subject.name / "truth" / f"{task.name}-{digest}.npz"

    def _say(self, *words: str) -> None:
        print(" ".join(words), file=sys.stderr, flush=True)


def _of_this_lamp(folder: Path, digest: str) -> None:
    """Make a system's folder; what it made ready for the lamp as it was before is thrown away."""
    mark = folder / "lamp.key"
    if mark.is_file() and mark.read_text() != digest:
        shutil.rmtree(folder)
    folder.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(mark, digest.encode())


def prepared(system: System, subject: Subject, folder: Path) -> Iterator[Cost]:
    """`prepare`, for a process of its own."""
    yield system.prepare(subject, folder)


def traced(
    task: JudgedTask, lacking: list[JudgedTask], subject: Subject, folder: Path, paths: int
) -> Iterator[tuple[str, Truth]]:
    """Names and truths, for a process of its own."""
    yield from task.truths(lacking, subject, folder / task.name, paths).items()


def spent(frame: Frame, threads: int) -> float:
    """Seconds of the processor where one thread works and they are known, else by the clock."""
    known = frame.processor is not None and threads == 1
    return frame.processor or 0.0 if known else frame.seconds


def pairs(
    frames: Iterator[Frame], limit: float, threads: int = 1
) -> Iterator[tuple[Frame, Frame, bool]]:
    """Each frame after the first with the one before, and whether it is the last.

    A series ends where the next frame, as long as all before together, would pass the limit of
    seconds of rendering.
    """
    earlier, ready = None, None
    for frame in frames:
        if ready is not None:
            yield (*ready, False)
        ready = (earlier, frame) if earlier is not None else None
        earlier = frame
        if ready is not None and 2 * spent(frame, threads) > limit:
            break
    close = getattr(frames, "close", None)
    if close is not None:
        close()
    if ready is None:
        raise PureLightError("it gave fewer than two frames")
    yield (*ready, True)


def _told(record: Record) -> str:
    value = record.figure("mape")
    return "" if value is None else f"MAPE {value:.3f}"
