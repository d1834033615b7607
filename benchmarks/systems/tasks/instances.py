"""Time and memory of many instances of a lamp: a hall, which no picture is judged by."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from benchmarks.systems.protocol import Subject
from benchmarks.systems.tasks import placing
from benchmarks.systems.tasks.task import JudgedTask
from purelight_examples.luminaires.lamp_scene import matt
from purelight_examples.scenes.furniture import wall
from purelight_examples.scenes.lamp_choice import LampChoice

APART, BELOW = 6.0, 6.0  # of lamps, and of the floor, in radii


@dataclass(frozen=True)
class Instances(JudgedTask):
    """A square array of lamps above a floor.

    Arguments:
        count: of lamps.
        size: pixels a side.
    """

    count: int
    size: int
    kind: str = "illumination"
    measured: bool = False

    @property
    def name(self) -> str:  # type: ignore[override]
        return f"instances_{self.count}"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """Lengths are in radii of the lamp."""
        unit = placing.sphere(subject, lamp).radius
        side = math.ceil(math.sqrt(self.count))
        reach = 0.5 * APART * side + 4
        sensor = placing.pinhole(
            (self.size, self.size), (0, -2.2 * reach, 1.2 * reach), (0, 0, -BELOW), 50, unit
        )
        floor = wall((0, 0, -BELOW * unit), 3, (reach * unit, reach * unit))
        lamps = []
        for number in range(self.count):
            at = [APART * unit * (k - (side - 1) / 2) for k in (number % side, number // side)]
            for element in placing.elements(subject, lamp, folder):
                element.set("id", f"{element.get('id', 'lamp')}_{number}")
                placing.move(element, (at[0], at[1], 0.0))
                lamps.append(element)
        part = matt("floor", floor, (0.6, 0.6, 0.6))
        return placing.write(folder, self.name, lamp, sensor, [part], lamps)
