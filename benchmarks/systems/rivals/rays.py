"""Replay of a finite set of rays, as ray files of LEDs and lamps are used."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Cost, Subject
from benchmarks.systems.rivals.accounts import Account, megabytes
from benchmarks.systems.rivals.xml import file_emitter, stock
from purelight_examples.scenes.lamp_choice import LampChoice, Point

NAME, FILE = "benchmark_rays", "lamp.tm25ray"
SEED = 11


@dataclass(frozen=True)
class RayLight:
    """A ray file as an emitter whose light is traced; a task may enlarge it (`ReplayEmitter`)."""

    file: Path
    enlarged: bool = True

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """One emitter."""
        return [file_emitter(NAME, self.file, folder, at)]

    def integrator(self) -> ET.Element:
        """The stock light tracer."""
        return stock("ptracer")


class Rays(MitsubaSystem):
    """A ray file (TM-25) of so many rays of the lamp, drawn by power and traced into the scene.

    Its light is traced out of the lamp's scene as ours is, with other random numbers. A pixel sees
    the surfaces that rays met; a lamp of rays cannot be seen by a camera without size.
    """

    answers = ("illumination",)

    def __init__(self, count: int) -> None:
        self.count = count
        self.name = f"rays_{count // 1_000_000}m" if count >= 1_000_000 else f"rays_{count}"
        self.label = f"Ray set: replay of {count:,} rays of the lamp (TM-25), light tracer"

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Trace the rays and write their file."""
        account = Account(folder)
        if not (folder / FILE).is_file():
            with account.stage("light"):
                _write(subject, self.count, folder / FILE)
        return Cost(account.total, megabytes([folder / FILE]), {**account.parts})

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The ray file."""
        return RayLight(folder / FILE)

    def register(self) -> None:
        """Bring in the emitter."""
        import mitsuba as mi

        from benchmarks.systems.rivals.ray_emitter import ReplayEmitter

        mi.register_emitter(NAME, ReplayEmitter)


def _write(subject: Subject, count: int, path: Path) -> None:
    from purelight_mitsuba.platform import use

    use()
    from purelight_export.rays import traced_rays
    from purelight_format.ray_file.conversion import file_of
    from purelight_format.ray_file.files import write_ray_file
    from purelight_train.light.luminaire import load_luminaire

    rays = traced_rays(load_luminaire(subject.scene), count, SEED)
    write_ray_file(path, file_of(rays, subject.name))
