"""The real lamp, by Mitsuba's own integrators."""

from __future__ import annotations

from pathlib import Path

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Cost, Subject
from purelight_examples.scenes.lamp_choice import LampChoice, RealLamp


class Real(MitsubaSystem):
    """The lamp's own shapes and materials; nothing is made of it before."""

    plugin: str

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The shapes of the lamp's scene file."""
        return RealLamp(subject.scene, self.plugin)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Nothing to make; a host holds the lamp's meshes."""
        files = [f for f in subject.scene.parent.rglob("*") if f.is_file()]
        return Cost(0.0, sum(f.stat().st_size for f in files) / 1e6)


class PathTracing(Real):
    """From the camera, with next event estimation."""

    name = "path"
    label = "Path tracing with next event estimation (Mitsuba `path`), the real lamp"
    plugin = "path"


class LightTracing(Real):
    """From the emitters; a smooth surface seen by the camera stays dark."""

    name = "ptracer"
    label = "Light tracing (Mitsuba `ptracer`), the real lamp: cannot show smooth glass or metal"
    plugin = "ptracer"
