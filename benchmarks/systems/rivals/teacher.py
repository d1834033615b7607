"""The paper's teacher, looked at before it is distilled."""

from __future__ import annotations

import time
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems import isolated
from benchmarks.systems.protocol import Cost, Frame, Image, Subject, Task
from benchmarks.systems.rivals.accounts import Account
from benchmarks.systems.rivals.distilled import taught
from benchmarks.systems.rivals.xml import stock
from purelight_examples.scenes.lamp_choice import Point
from purelight_format.errors import PureLightError
from purelight_mitsuba.scene_file import load_scene

PHOTON = 36  # bytes of a photon of the map: position, normal and weight


@dataclass(frozen=True)
class NoLamp:
    """Nothing where the lamp is."""

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """None."""
        return []

    def integrator(self) -> ET.Element:
        """The stock path tracer."""
        return stock("path")


class Teacher:
    """Photon map times directional flow, evaluated where camera rays meet the exit surface.

    No bundle holds it and no scene is lit by it: what it is worth is seen in views of the lamp
    before black. What would be seen through the lamp is black, too.
    """

    name = "teacher"
    label = "The paper's teacher itself: photon map times directional flow, not distilled"
    answers = ("appearance",)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Trace the light and train the flow."""
        from purelight_mitsuba.platform import use

        use()
        account, told = Account(folder), folder / "photons.txt"
        if not told.is_file():
            training = taught(subject, folder, account)
            told.write_text(str(len(training.lamp.records)))
        flow = folder / "run/networks/teacher.safetensors"
        size = (flow.stat().st_size + PHOTON * int(told.read_text())) / 1e6
        return Cost(account.total, size, {**account.parts})

    def frames(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        """Pictures of the lamp alone; see `protocol.System`."""
        if task.kind not in self.answers:
            raise PureLightError(f"{self.name} cannot show {task.kind}")
        yield from isolated.results(rendered, subject, task, folder, samples, seed)


def rendered(
    subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
) -> Iterator[Frame]:
    """The same in this process."""
    from purelight_mitsuba.platform import use

    start = time.perf_counter()
    use()
    where = folder / task.name
    where.mkdir(parents=True, exist_ok=True)
    scene = load_scene(task.scene(subject, NoLamp(), where))
    if scene.shapes():
        raise PureLightError("teacher: the task has more in it than the lamp")
    training = taught(subject, folder, Account(where))
    rng, done, seconds, processor = np.random.default_rng([seed, 7]), 0, 0.0, 0.0
    _look(training, scene, subject.centre, rng)  # builds the photon map
    total: Image = np.zeros(())
    warm_up = time.perf_counter() - start
    for count in samples:
        start, begun = time.perf_counter(), time.process_time()
        while done < count:
            total, done = total + _look(training, scene, subject.centre, rng), done + 1
        seconds += time.perf_counter() - start
        processor += time.process_time() - begun
        memory = isolated.peak_megabytes()
        yield Frame(total / done, done, seconds, warm_up, memory, processor)


def _look(training: Any, scene: Any, centre: Point, rng: np.random.Generator) -> Image:
    """One ray through each pixel."""
    import mitsuba as mi

    from purelight_train.light.radiance_field import look

    sensor = scene.sensors()[0]
    width, height = (int(v) for v in sensor.film().size())
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 2)
    place = ((grid + rng.random(grid.shape)) / (width, height)).T.astype(np.float32)
    lens = rng.random((2, len(grid))).astype(np.float32)
    ray, _ = sensor.sample_ray(0, 0.5, mi.Point2f(place), mi.Point2f(lens))
    origin, direction = (np.array(v, np.float64).T for v in (ray.o, ray.d))
    start = (origin + np.array(centre)).astype(np.float32)
    seen = look(
        training.lamp.surface, training.teacher.radiance, start, direction.astype(np.float32)
    )
    return seen.reshape(height, width, 3).astype(np.float64)
