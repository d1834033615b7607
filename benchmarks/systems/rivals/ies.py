"""A point light with a lamp's far field: what lighting programs make of an IES file."""

from __future__ import annotations

import shutil
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Cost, Subject
from benchmarks.systems.rivals.accounts import megabytes, stage_seconds
from benchmarks.systems.rivals.xml import file_emitter, stock
from purelight_examples.scenes.lamp_choice import LampChoice, Point
from purelight_format.bundle import Bundle
from purelight_format.errors import PureLightError

NAME = "benchmark_ies"


@dataclass(frozen=True)
class IesLight:
    """A point with the far field of an IES file.

    Arguments:
        file: the IES file, whose nadir is -Z of the lamp's frame.
        flux: radiant flux in W: RGB. The file has no colours, which are those of the whole lamp.
        centre: where the point is in the lamp's frame, in m.
        enlarged: whether a task may enlarge it.
    """

    file: Path
    flux: tuple[float, float, float]
    centre: Point
    enlarged: bool = True  # flux grows with the square of the size

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """One emitter."""
        light = file_emitter(NAME, self.file, folder, at)
        for name, value in (("flux", self.flux), ("centre", self.centre)):
            ET.SubElement(light, "rgb", name=name, value=", ".join(repr(float(v)) for v in value))
        return [light]

    def integrator(self) -> ET.Element:
        """The stock path tracer."""
        return stock("path")


class Ies(MitsubaSystem):
    """The IES file that is exported with the bundle, as a point light for Mitsuba's `path`.

    The photons are those that our networks were trained with, and what they cost is told. The point
    stands at the centre of the light that leaves the exit surface. Its light has the colour of the
    whole lamp, and nothing of the lamp is in its way: that is what an IES file says.
    """

    name = "ies"
    label = "IES point light: far field of the same photons (LM-63, 2.5° x 15°), path tracer"
    answers = ("illumination",)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """The file as a system has it to hold."""
        source = subject.bundle.with_suffix(".ies")
        if not source.is_file():
            raise PureLightError(f"{source}: no such file; purelight-export writes it")
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, folder / "lamp.ies")
        traced = stage_seconds(subject).get("light", 0.0)
        return Cost(traced, megabytes([folder / "lamp.ies"]), {"light": traced})

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The point light."""
        return IesLight(folder / "lamp.ies", subject.flux, light_centre(subject.bundle))

    def register(self) -> None:
        """Bring in the emitter."""
        import mitsuba as mi

        from benchmarks.systems.rivals.ies_emitter import IesEmitter

        mi.register_emitter(NAME, IesEmitter)


def light_centre(bundle: Path) -> Point:
    """The mean of the exit surface's triangles by their flux, in m."""
    surface = Bundle.open(bundle).surface()
    corners = surface.positions.astype(np.float64)[surface.triangles]
    power = surface.triangle_flux.astype(np.float64).sum(1)
    x, y, z = np.average(corners.mean(1), axis=0, weights=power).tolist()
    return x, y, z
