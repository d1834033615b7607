"""What renders in Mitsuba: a system is then a lamp for the task's scene, and an integrator."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems import isolated
from benchmarks.systems.protocol import Cost, Frame, Image, Subject, Task
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_format.errors import PureLightError

WAVEFRONT = 1 << 21  # paths of a pass at most: what a pass needs of memory does not grow further
SEEDS = 1 << 16  # of passes, for each seed of a series


class MitsubaSystem(ABC):
    """A system whose pictures Mitsuba renders, in a process of their own.

    A subclass says `name`, `label`, `answers` and, where it is more than nothing, `prepare`; its
    instances must be picklable. `lamp` and `register` are called in the process that renders.
    """

    name: str
    label: str
    answers: tuple[str, ...] = ("illumination", "appearance")

    @abstractmethod
    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """What stands for the lamp, made of what `prepare` left in the folder.

        Its elements may be any of Mitsuba's or of plugins that `register` registers, and its
        integrator any that has radiance in W/(m² sr) as its picture.
        """

    def register(self) -> None:  # noqa: B027 - most have none
        """Register plugins of one's own; Mitsuba has its variant, and PureLight's are there."""

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Nothing to make, and nothing to hold."""
        return Cost(0.0, 0.0)

    def frames(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        """Pictures at growing counts of samples per pixel; see `protocol.System`."""
        if task.kind not in self.answers:
            raise PureLightError(f"{self.name} cannot show {task.kind}")
        yield from isolated.results(self.rendered, subject, task, folder, samples, seed)

    def rendered(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        """The same in this process.

        The first pass, of the size of the first frame, is warm-up and thrown away: Dr.Jit compiles
        its kernels then, or loads them from its cache.
        """
        start = time.perf_counter()
        scene = self._scene(subject, task, folder)
        pixels = int(np.prod(scene.sensors()[0].film().size()))
        _render(scene, min(samples[0], _most(pixels)), seed * SEEDS)
        warm_up = time.perf_counter() - start
        total: Any = 0.0
        done, number, seconds = 0, 0, 0.0
        for count in samples:
            start = time.perf_counter()
            while done < count:
                spp, number = min(count - done, _most(pixels)), number + 1
                total = total + spp * _render(scene, spp, seed * SEEDS + number)
                done += spp
            seconds += time.perf_counter() - start
            memory = isolated.peak_megabytes()
            yield Frame(total / done, done, seconds, warm_up, memory)

    def _scene(self, subject: Subject, task: Task, folder: Path) -> Any:
        from purelight_mitsuba.platform import use

        mi = use()
        import drjit as dr

        mi.set_log_level(mi.LogLevel.Error)
        dr.set_thread_count(subject.threads)
        self.register()
        where = folder / task.name
        where.mkdir(parents=True, exist_ok=True)
        return mi.load_file(str(task.scene(subject, self.lamp(subject, folder), where)))


def _most(pixels: int) -> int:
    """Samples per pixel of a pass at most."""
    return max(WAVEFRONT // pixels, 1)


def _render(scene: Any, spp: int, seed: int) -> Image:
    """Linear RGB [H, W, 3] of one pass; pixels that are not finite count as black."""
    import mitsuba as mi

    image = np.array(mi.render(scene, spp=spp, seed=seed & 0xFFFFFFFF), np.float64)[..., :3]
    return np.where(np.isfinite(image).all(-1, keepdims=True), image, 0.0)
