"""A bedroom with a lantern in its middle and a lamp beside the bed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_examples.luminaires import solids
from purelight_examples.luminaires.lamp_scene import RGB, Part, matt
from purelight_examples.luminaires.materials import glaze, matt_paint
from purelight_examples.scenes.furniture import Box, boxes, wall
from purelight_examples.scenes.interior import Interior, View, cord, hung, stood
from purelight_examples.scenes.place import Place
from purelight_examples.scenes.surfaces import planks, shell

WALNUT = glaze((0.2, 0.11, 0.06), 0.2)
LINEN: RGB = (0.74, 0.71, 0.65)
BED_X, BACK = 0.2, 1.8


@dataclass(frozen=True)
class Bedroom(Interior):
    """A room of 3.8 by 3.6 m with a bed for two.

    Arguments:
        pendant: from the ceiling, `drop` below it.
        bedside: on the night stands; none if empty.
    """

    name: str = "bedroom"
    height: float = 2.6
    pendant: str = "medieval"
    drop: float = 0.35
    bedside: str = "table_lamp"
    daylight: float = 0.0

    def view(self) -> View:
        """From the foot of the bed."""
        return View((1.75, -1.68, 1.6), (-0.35, 0.85, 1.2), 68.0)

    def places(self) -> dict[str, list[Place]]:
        """The lantern, and two table lamps."""
        found = {self.pendant: [hung(self.pendant, -0.1, 0.1, self.height, self.drop, 15.0)]}
        if self.bedside:
            found[self.bedside] = [
                stood(self.bedside, BED_X + s * 1.15, BACK - 0.25, 0.53) for s in (-1, 1)
            ]
        return found

    def window(self) -> trimesh.Trimesh:
        """In the wall on the left, between the curtains."""
        return wall((-1.89, 0.35, 1.4), 1, (0.55, 0.6))

    def parts(self) -> list[Part]:
        """Shell, bed, stands, books, rug, picture, curtains."""
        hang = cord(self.places()[self.pendant][0], self.height, self.pendant)
        frame = boxes([((0.2, BACK - 0.015, 1.75), (0.9, 0.03, 0.6))])
        picture = boxes([((0.2, BACK - 0.032, 1.75), (0.8, 0.005, 0.5))])
        return [
            matt("walls", shell((-1.9, 1.9), (-1.8, BACK), self.height), (0.72, 0.69, 0.64)),
            *planks((-1.9, 1.9), (-1.8, BACK)),
            *_bed(),
            *_stands(),
            matt("rug", boxes([((0.1, -0.45, 0.016), (2.6, 1.9, 0.014))]), (0.48, 0.42, 0.36)),
            matt("frame", frame, (0.05, 0.04, 0.03)),
            matt("picture", picture, (0.2, 0.32, 0.42)),
            matt("curtains", _curtains(), (0.34, 0.4, 0.36)),
            matt("cord", hang, (0.05, 0.05, 0.05)),
        ]


def _bed() -> list[Part]:
    """Frame, mattress, a duvet with folds, pillows, a blanket at the foot, a headboard."""
    low, high = -0.4, BACK - 0.14
    middle, long = 0.5 * (low + high), high - low
    frame: list[Box] = [((BED_X, middle, 0.19), (1.72, long, 0.14))]
    frame += [
        ((BED_X + a * 0.78, middle + b * (0.5 * long - 0.08), 0.06), (0.07, 0.07, 0.12))
        for a in (-1, 1)
        for b in (-1, 1)
    ]
    head = [
        ((BED_X + 0.43 * k, BACK - 0.08, 0.72), (0.42, 0.09, 0.72)) for k in (-1.5, -0.5, 0.5, 1.5)
    ]
    pillows = [_pillow((BED_X + s * 0.4, high - 0.3, 0.62)) for s in (-1, 1)]
    return [
        Part("bed", boxes(frame), WALNUT),
        matt("headboard", boxes(head), (0.3, 0.34, 0.36)),
        matt(
            "mattress",
            boxes([((BED_X, middle, 0.38), (1.64, long - 0.06, 0.22))]),
            (0.78, 0.77, 0.74),
        ),
        matt("duvet", _duvet(low, high - 0.62), LINEN),
        matt("pillows", trimesh.util.concatenate(pillows), (0.8, 0.79, 0.76)),
        matt("blanket", _duvet(low + 0.1, low + 0.6, 0.025), (0.45, 0.2, 0.13)),
    ]


def _duvet(low: float, high: float, lift: float = 0.0) -> trimesh.Trimesh:
    """A cover that hangs over both sides of the bed, in folds."""
    s, y = np.meshgrid(np.linspace(-1, 1, 97), np.linspace(low, high, 41), indexing="ij")
    reach = 1.14 * s
    x = np.clip(reach, -0.86, 0.86) + 0.02 * np.clip(np.abs(reach) - 0.86, 0, 1) * np.sin(22 * y)
    down = np.clip(np.abs(reach) - 0.84, 0, 1)
    fold = 0.012 * np.sin(9 * reach + 3 * np.sin(4 * y)) + 0.01 * np.sin(13 * y + 2 * reach)
    z = 0.55 + lift + fold * (down == 0) - down - 0.04 * np.abs(s) ** 8
    return solids.slab(np.stack((BED_X + x * (1 + 0.4 * lift), y, z), -1), 0.02)


def _pillow(at: tuple[float, float, float]) -> trimesh.Trimesh:
    """A soft square: a sphere with its sides drawn out."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    flat = np.sign(ball.vertices) * np.abs(ball.vertices) ** (0.65, 0.65, 1.0)
    ball.vertices = flat * (0.34, 0.22, 0.1)
    tilt = trimesh.transformations.rotation_matrix(0.35, [1, 0, 0])
    return ball.apply_transform(tilt).apply_translation(at)


def _stands() -> list[Part]:
    """Night stands with drawers; books on the bed."""
    body: list[Box] = []
    fronts: list[Box] = []
    for side in (-1, 1):
        x = BED_X + side * 1.15
        body.append(((x, BACK - 0.22, 0.3), (0.46, 0.4, 0.46)))
        fronts += [((x, BACK - 0.43, z), (0.43, 0.02, 0.2)) for z in (0.19, 0.41)]
    books: list[Box] = [
        ((BED_X + 0.4, 0.02, 0.605), (0.14, 0.2, 0.025)),
        ((BED_X + 0.41, 0.03, 0.6275), (0.12, 0.18, 0.02)),
    ]
    return [
        Part("stands", boxes(body), WALNUT),
        Part("drawers", boxes(fronts), glaze((0.26, 0.15, 0.08), 0.2)),
        Part("books", boxes(books), matt_paint((0.5, 0.13, 0.1))),
    ]


def _curtains() -> trimesh.Trimesh:
    """Two hangings in folds on either side of the window, and their pole."""
    made = []
    for low, high in ((-0.75, -0.2), (0.9, 1.45)):
        y, z = np.meshgrid(np.linspace(low, high, 121), np.linspace(0.02, 2.3, 3), indexing="ij")
        x = -1.8 + 0.035 * np.sin(2 * np.pi * (y - low) / 0.09)
        made.append(solids.slab(np.stack((x, y, z), -1), 0.004))
    pole = trimesh.creation.cylinder(0.012, 2.5, sections=16)
    quarter = trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0])
    made.append(pole.apply_transform(quarter).apply_translation([-1.8, 0.35, 2.33]))
    return trimesh.util.concatenate(made)
