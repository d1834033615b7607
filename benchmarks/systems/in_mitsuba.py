"""What renders in Mitsuba: a system is then a lamp for the task's scene, and an integrator."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems import isolated
from benchmarks.systems.protocol import Cost, Frame, Image, Subject, Task
from benchmarks.systems.tasks.task import ready
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_format.errors import PureLightError
from purelight_mitsuba.scene_file import load_scene

WAVEFRONT = 1 << 19  # paths of a pass at most: what a pass needs of memory does not grow further
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

        The first pass, of the size of the first frame, is warm-up and thrown away, and so is each
        pass for which Dr.Jit made or loaded a kernel: it is rendered once more and timed then.
        """
        start = time.perf_counter()
        scene = self._scene(subject, task, folder)
        pixels = int(np.prod(scene.sensors()[0].film().size()))
        _once(scene, min(samples[0], _most(pixels)), seed * SEEDS)
        warm_up, seconds, processor = time.perf_counter() - start, 0.0, 0.0
        total: Any = 0.0
        done = number = 0
        for count in samples:
            while done < count:
                spp, number = min(count - done, _most(pixels)), number + 1
                one = _once(scene, spp, seed * SEEDS + number)
                if one.compiled:
                    warm_up += one.seconds
                    one = _once(scene, spp, seed * SEEDS + number)
                total, done = total + spp * one.image, done + spp
                seconds, processor = seconds + one.seconds, processor + one.processor
            memory = isolated.peak_megabytes()
            yield Frame(total / done, done, seconds, warm_up, memory, processor)

    def _scene(self, subject: Subject, task: Task, folder: Path) -> Any:
        ready(subject.threads)
        self.register()
        where = folder / task.name
        where.mkdir(parents=True, exist_ok=True)
        return load_scene(task.scene(subject, self.lamp(subject, folder), where))


def _most(pixels: int) -> int:
    """Samples per pixel of a pass at most: a power of two, so that few sizes need a kernel."""
    return 1 << max(WAVEFRONT // pixels, 1).bit_length() - 1


@dataclass(frozen=True)
class _Pass:
    """A rendering, its seconds by the clock and of all processors; whether kernels were made."""

    image: Image
    seconds: float
    processor: float
    compiled: bool


def _once(scene: Any, spp: int, seed: int) -> _Pass:
    import drjit as dr

    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        start, begun = time.perf_counter(), time.process_time()
        image = _render(scene, spp, seed)
        spent = time.perf_counter() - start, time.process_time() - begun
        made = [k for k in dr.kernel_history() if not k.get("cache_hit", 1) or k.get("cache_disk")]
    return _Pass(image, *spent, bool(made))


def _render(scene: Any, spp: int, seed: int) -> Image:
    """Linear RGB [H, W, 3] of one pass; pixels that are not finite count as black."""
    import mitsuba as mi

    image = np.array(mi.render(scene, spp=spp, seed=seed & 0xFFFFFFFF), np.float64)[..., :3]
    return np.where(np.isfinite(image).all(-1, keepdims=True), image, 0.0)
