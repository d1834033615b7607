"""An elevator hall whose ceiling is full of one lamp."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import Part, matt
from purelight_examples.luminaires.materials import BLACK, BRUSHED, glaze, tinted_metal
from purelight_examples.scenes.furniture import Box, boxes, turned
from purelight_examples.scenes.interior import Interior, View, hung
from purelight_examples.scenes.place import Place
from purelight_examples.scenes.surfaces import floor_tiles, shell

BRONZE = tinted_metal((0.42, 0.34, 0.22), 0.25)
MARBLE, DARK = glaze((0.68, 0.65, 0.6), 0.06), glaze((0.12, 0.11, 0.11), 0.06)


@dataclass(frozen=True)
class ElevatorHall(Interior):
    """A hall with elevators on both sides; all lamps share one bundle.

    Arguments:
        lamp: at each crossing of `rows` along the hall and `columns` across.
        doors: on each side.
    """

    name: str = "elevator_hall"
    width: float = 3.2
    length: float = 9.0
    height: float = 2.8
    lamp: str = "crystal"
    rows: int = 10
    columns: int = 4
    doors: int = 3
    daylight: float = 0.0

    def view(self) -> View:
        """Down the hall."""
        return View((1.15, 0.3, 1.55), (-0.65, 0.7 * self.length, 1.4), 68.0)

    def places(self) -> dict[str, list[Place]]:
        """The lamps below the ceiling, each turned and sized a little otherwise."""
        x = (np.arange(self.columns) + 0.5) / self.columns - 0.5
        y = (np.arange(self.rows) + 0.5) / self.rows
        found = [
            hung(self.lamp, float(a * self.width), float(b * self.length), self.height, 0.0,
                 float(37 * i + 61 * j) % 360, 1.0 + 0.25 * ((i + j) % 2))
            for j, b in enumerate(y) for i, a in enumerate(x)
        ]  # fmt: skip
        return {self.lamp: found}

    def parts(self) -> list[Part]:
        """Walls, floor, elevators, and what stands at the end."""
        half, depth = 0.5 * self.width, self.length
        steel, frames, slots = self._elevators()
        base = [((s * (half - 0.006), 0.5 * depth, 0.06), (0.012, depth, 0.12)) for s in (-1, 1)]
        table = [
            ((0, depth - 0.25, 0.78), (1.2, 0.35, 0.04)),
            ((0, depth - 0.25, 0.38), (0.9, 0.2, 0.76)),
        ]
        vase = [(0, 0), (0.07, 0), (0.12, 0.12), (0.1, 0.24), (0.04, 0.33), (0.06, 0.36), (0, 0.35)]
        return [
            matt("walls", shell((-half, half), (0, depth), self.height), (0.74, 0.7, 0.62)),
            *floor_tiles((-half, half), (0, depth), 0.4, (MARBLE, DARK)),
            Part("doors", boxes(steel), BRUSHED),
            Part("frames", boxes(frames), BRONZE),
            Part("slots", boxes(slots), BLACK),
            Part("base", boxes(base), DARK),
            Part("table", boxes(table), glaze((0.2, 0.1, 0.05), 0.1)),
            Part("vase", turned(vase, (0, depth - 0.25, 0.802)), glaze((0.6, 0.1, 0.08))),
            Part("mirror", self._mirror(), BRUSHED),
        ]

    def _elevators(self) -> tuple[list[Box], list[Box], list[Box]]:
        """Two leaves each, their frames, and the dark: between leaves, buttons, displays."""
        steel: list[Box] = []
        frames: list[Box] = []
        slots: list[Box] = []
        for side in (-1, 1):
            x = side * 0.5 * self.width
            for k in range(self.doors):
                y = self.length * (k + 0.6) / (self.doors + 0.2)
                steel += [
                    ((x - side * 0.02, y + s * 0.277, 1.05), (0.02, 0.538, 2.1)) for s in (-1, 1)
                ]
                slots.append(((x - side * 0.005, y, 1.05), (0.01, 1.1, 2.1)))
                slots.append(((x - side * 0.01, y, 2.36), (0.02, 0.3, 0.12)))
                frames += [
                    ((x - side * 0.03, y + s * 0.6, 1.1), (0.06, 0.09, 2.2)) for s in (-1, 1)
                ]
                frames.append(((x - side * 0.03, y, 2.155), (0.06, 1.11, 0.09)))
                slots.append(((x - side * 0.006, y + 0.85, 1.1), (0.012, 0.1, 0.22)))
        return steel, frames, slots

    def _mirror(self) -> trimesh.Trimesh:
        """A round sheet of metal on the end wall."""
        disc = trimesh.creation.cylinder(0.55, 0.02, sections=96)
        quarter = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
        return disc.apply_transform(quarter).apply_translation([0, self.length - 0.012, 1.7])
