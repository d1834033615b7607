"""Illumination: a closed matt room around the lamp, seen past it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import trimesh

from benchmarks.past_lamp import past_lamp
from benchmarks.systems.protocol import Subject
from benchmarks.systems.tasks import placing
from benchmarks.systems.tasks.task import JudgedTask
from benchmarks.systems.tasks.truth import Mask
from purelight_examples.luminaires.lamp_scene import Part, matt
from purelight_examples.scenes.furniture import boxes, wall
from purelight_examples.scenes.lamp_choice import LampChoice, RealLamp

HALF = 5.0  # the room's side, in radii of the lamp, which hangs in its middle
EYE, AIM, FOV = (-4.6, -4.5, 0.5), (1.75, 1.5, -2.25), 80.0
WHITE, RED, GREEN = (0.6, 0.58, 0.55), (0.5, 0.07, 0.06), (0.12, 0.4, 0.09)


@dataclass(frozen=True)
class Room(JudgedTask):
    """A Cornell-like box about the lamp with a block in it, and a pinhole camera in a corner.

    Pixels that see the lamp are not judged: a light tracer cannot draw what smooth glass shows, and
    what a rival puts around the lamp is not its light.

    Arguments:
        size: pixels a side.
    """

    size: int
    name: str = "room"
    kind: str = "illumination"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """Lengths are in radii of the lamp."""
        unit = placing.sphere(subject, lamp).radius
        sensor = placing.pinhole((self.size, self.size), EYE, AIM, FOV, unit)
        lamps = placing.elements(subject, lamp, folder)
        return placing.write(folder, self.name, lamp, sensor, parts(unit), lamps)

    def mask(self, subject: Subject, scene: Any) -> Mask:
        """Pixels whose rays pass the lamp."""
        about = placing.sphere(subject, RealLamp(subject.scene))
        return past_lamp(scene.sensors()[0], about, placing.CLEAR)


def parts(unit: float) -> list[Part]:
    """Walls, seen from inside, and a block on the floor.

    Arguments:
        unit: in m.
    """
    h = HALF * unit
    white = trimesh.util.concatenate([
        wall((0, 0, -h), 3, (h, h)), wall((0, 0, h), -3, (h, h)),
        wall((0, h, 0), -2, (h, h)), wall((0, -h, 0), 2, (h, h)),
    ])  # fmt: skip
    block = boxes([((0.45 * h, 0.35 * h, -0.72 * h), (0.5 * h, 0.45 * h, 0.56 * h))])
    return [
        matt("white", white, WHITE),
        matt("red", wall((-h, 0, 0), 1, (h, h)), RED),
        matt("green", wall((h, 0, 0), -1, (h, h)), GREEN),
        matt("block", block, (0.35, 0.4, 0.5)),
    ]
