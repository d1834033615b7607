"""What every task has besides its scene: a truth, and figures of its own."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems.protocol import Subject
from benchmarks.systems.tasks.truth import Mask, Truth
from purelight_examples.scenes.lamp_choice import LampChoice, RealLamp
from purelight_mitsuba.scene_file import load_scene
from purelight_train.truth.picture import Passes, Picture

PASSES = 16  # of a light-traced truth, at least
PATHS_OF_A_PASS = 1 << 21
SEED = 0x7A57  # of truths: that of no series
Figures = dict[str, Any]


class JudgedTask(ABC):
    """A task with a truth. Subclasses are frozen dataclasses: their `repr` says what they are.

    Arguments:
        name, kind: see `protocol.Task`.
        measured: whether pictures are judged; else time and memory alone.
    """

    name: str
    kind: str
    measured: bool = True

    @abstractmethod
    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """Write the scene with this lamp in it; returns the XML's path."""

    def mask(self, subject: Subject, scene: Any) -> Mask:
        """Pixels that are judged, all by default; `scene` is the loaded one of the real lamp."""
        width, height = (int(n) for n in scene.sensors()[0].film().size())
        return np.ones((height, width), bool)

    def truth(self, subject: Subject, folder: Path, paths: int) -> Truth:
        """The real lamp by Mitsuba's light tracer in this task's scene; for a process of its own.

        Arguments:
            paths: light paths in all, rounded up to whole passes.
        """
        mi = ready(subject.threads)
        start = time.perf_counter()
        folder.mkdir(parents=True, exist_ok=True)
        path = self.scene(subject, RealLamp(subject.scene, "ptracer"), folder)
        scene = load_scene(path)
        pixels = int(np.prod(scene.sensors()[0].film().size()))
        count = 2 * -(-max(PASSES, paths // PATHS_OF_A_PASS) // 2)
        spp, sums = max(paths // count // pixels, 1), Passes()
        for seed in range(count):
            image = mi.render(scene, spp=spp, seed=SEED + seed)
            sums.add(np.nan_to_num(np.array(image, np.float64)[..., :3], posinf=0.0, neginf=0.0))
        seconds = time.perf_counter() - start
        return Truth(sums.picture(), self.mask(subject, scene), count * spp * pixels, seconds)

    def truths(
        self, tasks: Sequence[JudgedTask], subject: Subject, folder: Path, paths: int
    ) -> dict[str, Truth]:
        """By name: this task's truth, and those of `tasks` that the same light paths give."""
        return {self.name: self.truth(subject, folder, paths)}

    def figures(self, subject: Subject, picture: Picture, truth: Truth) -> Figures:
        """What this task asks besides the usual errors."""
        return {}


def ready(threads: int) -> Any:
    """Mitsuba with its variant, quiet, on so many threads."""
    from purelight_mitsuba.platform import use

    mi = use()
    import drjit as dr

    mi.set_log_level(mi.LogLevel.Error)
    dr.set_thread_count(threads)
    return mi
