"""Illuminance on a floor below the lamp, on a grid as EN 12464-1:2021 lays it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.systems.protocol import Image, Subject
from benchmarks.systems.tasks import placing
from benchmarks.systems.tasks.task import Figures, JudgedTask
from benchmarks.systems.tasks.truth import Truth
from purelight_examples.luminaires.lamp_scene import matt
from purelight_examples.scenes.furniture import wall
from purelight_examples.scenes.lamp_choice import LampChoice
from purelight_format.color import LUMENS_PER_WATT, LUMINANCE
from purelight_train.truth.picture import Picture, means

BELOW, SIDE = 10.0, 20.0  # of the floor, in radii of the lamp
ALBEDO = 0.01  # so dark that what it sends back to the lamp does not count
MOST = 10.0  # metres between points of the grid, EN 12464-1, 4.4


@dataclass(frozen=True)
class Floor(JudgedTask):
    """A square floor seen by a pinhole between it and the lamp; radiance is albedo E / pi.

    Arguments:
        pixels: a side of each cell of the grid, whose illuminance is their mean.
    """

    pixels: int
    name: str = "floor"
    kind: str = "illumination"

    def scene(self, subject: Subject, lamp: LampChoice, folder: Path) -> Path:
        """The camera is a quarter of the floor's side above it, and sees all of it."""
        unit = placing.sphere(subject, lamp).radius
        size = self.pixels * cells(SIDE * subject.radius)
        eye = (0.0, 0.0, 0.25 * SIDE - BELOW)
        sensor = placing.pinhole(
            (size, size), eye, (0.0, 0.0, -BELOW), math.degrees(2 * math.atan(2)), unit, "0, 1, 0"
        )
        floor = wall((0, 0, -BELOW * unit), 3, (SIDE * unit, SIDE * unit))
        part = matt("floor", floor, (ALBEDO,) * 3)
        lamps = placing.elements(subject, lamp, folder)
        return placing.write(folder, self.name, placing.in_the_open(lamp), sensor, [part], lamps)

    def figures(self, subject: Subject, picture: Picture, truth: Truth) -> Figures:
        """Illuminance in lux and its relative errors; uniformity U0 is least over mean.

        Returns:
            `lux`, `true_lux`: means. `lux_error`: of the mean. `lux_absolute`: mean absolute error
            of the cells over the mean; `lux_noise` that of the truth by its halves.
            `uniformity`, `true_uniformity`. Nothing but the means where no light falls.
        """
        told, true = (lux(p.image, self.pixels) for p in (picture, truth.picture))
        halves = [lux(half, self.pixels) for half in truth.picture.halves]
        found: Figures = {"lux": float(told.mean()), "true_lux": float(true.mean())}
        if not true.mean() > 0:
            return found
        return found | {
            "lux_error": float(told.mean() / true.mean() - 1),
            "lux_absolute": float(np.abs(told - true).mean() / true.mean()),
            "lux_noise": float(np.abs(halves[0] - halves[1]).mean() / (2 * true.mean())),
            "uniformity": float(told.min() / told.mean()) if told.mean() > 0 else 0.0,
            "true_uniformity": float(true.min() / true.mean()),
        }


def cells(side: float) -> int:
    """Cells along the side of a square floor in m: the whole number nearest to side / p.

    p = 0.2 · 5^log10(side), 10 m at most.

    >>> cells(10.0), cells(2.0), cells(5.0)
    (10, 6, 8)
    """
    spacing = min(0.2 * 5 ** math.log10(side), MOST)
    return max(math.floor(side / spacing + 0.5), 1)


def lux(image: Image, pixels: int) -> NDArray[np.float64]:
    """Illuminance of the grid's cells, from the floor's radiance."""
    cell = means(image, pixels)
    value: NDArray[np.float64] = LUMENS_PER_WATT * math.pi / ALBEDO * (cell @ LUMINANCE)
    return value
