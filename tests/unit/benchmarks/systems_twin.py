"""Made-up lamps, tasks and systems for tests of the benchmark of systems."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems.protocol import Cost, Frame, Subject, Task
from benchmarks.systems.records import Record
from benchmarks.systems.tasks.task import JudgedTask
from benchmarks.systems.tasks.truth import Truth
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_format.errors import PureLightError
from purelight_train.truth.picture import Passes

LEVEL, SIZE = 2.0, 8


def subject(folder: Path, radius: float = 0.05) -> Subject:
    return Subject(
        "ball", folder / "ball.xml", folder, folder / "lamp.plux", (0.1, 0.0, -0.2), radius,
        (1.0, 1.0, 1.0),
    )  # fmt: skip


@dataclass(frozen=True)
class Grey(JudgedTask):
    """An even picture of `LEVEL`, known with a little noise."""

    name: str = "room"
    kind: str = "illumination"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        return folder

    def truth(self, subject: Subject, folder: Path, paths: int) -> Truth:
        sums, rng = Passes(), np.random.default_rng(5)
        for _ in range(8):
            sums.add(LEVEL + 0.01 * rng.standard_normal((SIZE, SIZE, 3)))
        return Truth(sums.picture(), np.ones((SIZE, SIZE), bool), paths, 0.0)


@dataclass(frozen=True)
class Shared(Grey):
    """Tasks whose truths come together; each call of `truths` leaves a line in `calls`."""

    name: str = "floor"

    def truths(
        self, tasks: Sequence[JudgedTask], subject: Subject, folder: Path, paths: int
    ) -> dict[str, Truth]:
        names = [task.name for task in tasks]
        with open(subject.run / "calls", "a") as file:
            print(*names, file=file)
        return {name: self.truth(subject, folder, paths) for name in names}


@dataclass(frozen=True)
class Noisy:
    """The picture times a factor, with a noise of one at one sample."""

    name: str = "noisy"
    factor: float = 1.0
    label: str = "made up"
    answers: tuple[str, ...] = ("illumination",)
    fails: str = ""

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        if self.fails == "prepare":
            raise PureLightError("nothing to be had")
        return Cost(3.0, 0.5)

    def frames(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        rng, total, done = np.random.default_rng(seed), np.zeros((SIZE, SIZE, 3)), 0
        for count in samples:
            total = total + rng.standard_normal((count - done, SIZE, SIZE, 3)).sum(0)
            done = count
            if self.fails == "frames":
                raise ValueError("out of\nluck")
            yield Frame(LEVEL * self.factor + total / done, done, 0.01 * done, 0.0)


def record(
    lamp: str, system: str, task: str, samples: int, seconds: float, error: float,
    memory: float = 200.0, **figures: Any,
) -> Record:  # fmt: skip
    """A record whose errors are all one number."""
    names = ("mape", "relative_error", "hdr_flip", "relative_variance", "mape_without_noise")
    told = dict.fromkeys(names, error) | {
        "mape_of_reference": 1e-3,
        "truth_variance": 1e-5,
        "mean": 0.01,
        "mean_noise": 0.001,
    }
    kind = "appearance" if task.startswith(("view", "glare")) else "illumination"
    return Record(
        lamp, system, task, "k", "c", kind, samples, seconds, seconds, 1.0, memory,
        {"seconds": 60.0, "megabytes": 2.0, "parts": {}}, told | figures,
    )  # fmt: skip
