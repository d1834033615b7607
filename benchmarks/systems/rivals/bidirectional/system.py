"""The system `bidirectional`."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from benchmarks.systems import isolated
from benchmarks.systems.protocol import Cost, Frame, Subject, Task
from benchmarks.systems.rivals.bidirectional import rendering
from purelight_examples.scenes.lamp_choice import RealLamp
from purelight_format.errors import PureLightError
from purelight_mitsuba.scene_file import load_scene


class Bidirectional:
    """The real lamp by BIDIRCPU of LuxCoreRender (pyluxcore), linear, without clamping.

    Scene and lamp are converted where LuxCore has materials of the same formula; other lamps are
    refused. Rough glass has Schlick's shadowing where Mitsuba has Smith's, and metals of a mere
    colour brighten at grazing angles. Paths of both ends have up to 32 vertices. Views of
    a lamp that has rough glass are refused (`materials.require_visible`).
    """

    name = "bidirectional"
    label = (
        "Bidirectional path tracing (LuxCoreRender BIDIRCPU by pyluxcore), the real lamp, "
        "converted by us"
    )
    answers = ("illumination", "appearance")

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Nothing to make; a host holds the lamp's meshes.

        Raises:
            PureLightError: pyluxcore is not installed.
        """
        if find_spec("pyluxcore") is None:
            raise PureLightError('pyluxcore is missing; pip install "purelight[bench]"')
        files = [f for f in subject.scene.parent.rglob("*") if f.is_file()]
        return Cost(0.0, sum(f.stat().st_size for f in files) / 1e6)

    def frames(
        self, subject: Subject, task: Task, folder: Path, samples: list[int], seed: int
    ) -> Iterator[Frame]:
        """Convert in one process, render in another: Mitsuba and LuxCore do not share one."""
        where = folder / task.name
        where.mkdir(parents=True, exist_ok=True)
        for _ in isolated.results(converted, subject, task, where):
            pass
        yield from isolated.results(rendering.frames, where, samples, seed, subject.threads)


def converted(subject: Subject, task: Task, folder: Path) -> Iterator[None]:
    """Write the task's scene with the real lamp, for LuxCore; for a process of its own."""
    from purelight_mitsuba.platform import use

    use()
    from benchmarks.systems.rivals.bidirectional.conversion import convert

    path = task.scene(subject, RealLamp(subject.scene.resolve()), folder)
    convert(load_scene(path, optimize=False), folder, seen=task.kind == "appearance")
    yield None
