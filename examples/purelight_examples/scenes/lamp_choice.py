"""The lamp that lights a scene: the asset, the real lamp, or a plain sphere of equal flux."""

from __future__ import annotations

import copy
import os
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

Point = tuple[float, float, float]


class LampChoice(Protocol):
    """What a scene needs of its lamp: XML for the lamp, and the integrator that renders it."""

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """The lamp with its frame's origin at `at`, for a scene file in `folder`."""
        ...

    def integrator(self) -> ET.Element:
        """The integrator for a scene with this lamp."""
        ...


@dataclass(frozen=True)
class NeuralLamp:
    """A `.plux` bundle; `mode` is accurate or fast, `scale` the lamp's size over its own."""

    bundle: Path
    mode: str = "accurate"
    scale: float = 1.0

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """One `purelight` emitter."""
        emitter = ET.Element("emitter", type="purelight", id="lamp")
        name = relative(self.bundle, folder)
        ET.SubElement(emitter, "string", name="filename", value=name)
        if self.scale != 1:
            transform = ET.SubElement(emitter, "transform", name="to_world")
            ET.SubElement(transform, "scale", value=f"{self.scale:g}")
        move(emitter, at)
        return [emitter]

    def integrator(self) -> ET.Element:
        """The `purelight` integrator in this mode."""
        integrator = ET.Element("integrator", type="purelight")
        ET.SubElement(integrator, "string", name="mode", value=self.mode)
        return integrator


@dataclass(frozen=True)
class RealLamp:
    """The shapes of a lamp's scene file.

    Arguments:
        plugin: path, or ptracer to light trace.
        roulette: bounces before Russian roulette. Eight is least noisy at equal time in a closed
            room; where light only leaves glass, paths that it thins out weigh much.
    """

    scene: Path
    plugin: str = "path"
    roulette: int = 8

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """The lamp's shapes, with their files named from `folder`."""
        shapes = [copy.deepcopy(e) for e in ET.parse(self.scene).getroot().iter("shape")]
        for shape in shapes:
            for name in shape.findall("string[@name='filename']"):
                name.set("value", relative(self.scene.parent / name.attrib["value"], folder))
            move(shape, at)
        return shapes

    def integrator(self) -> ET.Element:
        """The stock integrator, with no limit on the bounces in the glass."""
        integrator = ET.Element("integrator", type=self.plugin)
        ET.SubElement(integrator, "integer", name="max_depth", value="-1")
        ET.SubElement(integrator, "integer", name="rr_depth", value=str(self.roulette))
        return integrator


@dataclass(frozen=True)
class SphereLamp:
    """A diffuse sphere that sends out `flux` in W per channel; radius in metres."""

    flux: tuple[float, float, float]
    radius: float = 0.05

    def elements(self, folder: Path, at: Point) -> list[ET.Element]:
        """One sphere with an area emitter: radiance = flux / (4 pi² radius²)."""
        shape = ET.Element("shape", type="sphere", id="lamp")
        ET.SubElement(shape, "float", name="radius", value=str(self.radius))
        move(shape, at)
        emitter = ET.SubElement(shape, "emitter", type="area")
        radiance = np.asarray(self.flux) / (4 * np.pi**2 * self.radius**2)
        value = ", ".join(f"{v:.6g}" for v in radiance)
        ET.SubElement(emitter, "rgb", name="radiance", value=value)
        return [shape]

    def integrator(self) -> ET.Element:
        """The stock path tracer."""
        return RealLamp(Path()).integrator()


def move(element: ET.Element, by: Point, scale: float = 1.0) -> None:
    """Shift a shape or an emitter after its own transform, and scale the world it is in."""
    transform = element.find("transform[@name='to_world']")
    if transform is None:
        transform = ET.SubElement(element, "transform", name="to_world")
    ET.SubElement(transform, "translate", value=", ".join(f"{v:g}" for v in by))
    if scale != 1:
        ET.SubElement(transform, "scale", value=f"{scale:g}")


def relative(file: Path, folder: Path) -> str:
    """A file's name in a scene that lies in a folder."""
    return os.path.relpath(file.resolve(), folder.resolve()).replace(os.sep, "/")
