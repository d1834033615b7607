"""A kitchen with an island below a pendant, and light under its cabinets."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from purelight_examples.luminaires.lamp_scene import Part, matt
from purelight_examples.luminaires.materials import BLACK, BRUSHED, glaze
from purelight_examples.scenes.furniture import Box, boxes, turned, wall
from purelight_examples.scenes.interior import Interior, View, cord, hung
from purelight_examples.scenes.place import Place
from purelight_examples.scenes.surfaces import floor_tiles, shell, wall_tiles

LACQUER, STONE = glaze((0.22, 0.33, 0.3), 0.2), glaze((0.72, 0.71, 0.69), 0.1)
OAK = glaze((0.42, 0.28, 0.16), 0.25)
BACK, ISLAND = 1.7, (0.25, 0.05)  # of the far wall; of the island's middle


@dataclass(frozen=True)
class Kitchen(Interior):
    """A kitchen of 4.2 by 3.5 m.

    Arguments:
        pendant: over the island, so many times its own size.
        bench: below the wall cabinets; none if empty.
    """

    name: str = "kitchen"
    height: float = 2.6
    pendant: str = "cluster"
    pendant_scale: float = 1.4
    drop: float = 0.25
    bench: str = "linear_led"
    daylight: float = 0.0

    def view(self) -> View:
        """Over the island towards the cabinets."""
        return View((1.75, -1.72, 1.6), (-0.3, 0.9, 1.2), 64.0)

    def places(self) -> dict[str, list[Place]]:
        """The pendant and two lights below the cabinets."""
        found = {
            self.pendant: [
                hung(self.pendant, *ISLAND, self.height, self.drop, 20.0, self.pendant_scale)
            ]
        }
        if self.bench:
            found[self.bench] = [hung(self.bench, x, BACK - 0.2, 1.5) for x in (-1.0, 1.15)]
        return found

    def window(self) -> trimesh.Trimesh:
        """In the wall on the left."""
        return wall((-2.085, -0.1, 1.55), 1, (0.6, 0.5))

    def parts(self) -> list[Part]:
        """Shell, cabinets, island, stools, and what lies about."""
        hang = cord(self.places()[self.pendant][0], self.height, self.pendant)
        frame: list[Box] = [
            ((-2.085, -0.1 + s * 0.63, 1.55), (0.03, 0.06, 1.12)) for s in (-1, 0, 1)
        ]
        frame += [((-2.085, -0.1, 1.55 + s * 0.53), (0.03, 1.2, 0.06)) for s in (-1, 1)]
        return [
            matt("walls", shell((-2.1, 2.1), (-1.8, BACK), self.height), (0.76, 0.74, 0.69)),
            *floor_tiles((-2.1, 2.1), (-1.8, BACK), 0.42, (glaze((0.45, 0.4, 0.35), 0.18),) * 1),
            wall_tiles(
                (-2.1, 2.1), (0.92, 1.52), BACK, (0.2, 0.075), glaze((0.78, 0.77, 0.73), 0.05)
            ),
            *_cabinets(),
            *_island(),
            *_still_life(),
            matt("cord", hang, (0.05, 0.05, 0.05)),
            matt("frame", boxes(frame), (0.75, 0.74, 0.7)),
        ]


def _cabinets() -> list[Part]:
    """Lower and wall cabinets with gaps between their doors, a worktop, a hood, a hob."""
    doors: list[Box] = []
    grips: list[Box] = []
    for k, x in enumerate(np.arange(-2.1, 2.09, 0.6) + 0.3):
        doors.append(((x, BACK - 0.59, 0.49), (0.594, 0.02, 0.75)))
        grips.append(((x, BACK - 0.61, 0.8), (0.2, 0.02, 0.012)))
        if k not in (3,):
            doors.append(((x, BACK - 0.34, 1.86), (0.594, 0.02, 0.7)))
            grips.append(((x, BACK - 0.36, 1.54), (0.2, 0.02, 0.012)))
    bodies: list[Box] = [((0, BACK - 0.295, 0.48), (4.19, 0.56, 0.76))]
    bodies += [
        ((-1.2, BACK - 0.165, 1.86), (1.79, 0.32, 0.7)),
        ((1.2, BACK - 0.165, 1.86), (1.79, 0.32, 0.7)),
    ]
    hood: list[Box] = [
        ((0.0, BACK - 0.25, 1.62), (0.58, 0.48, 0.06)),
        ((0.0, BACK - 0.14, 2.12), (0.26, 0.26, 0.94)),
    ]
    return [
        Part("doors", boxes(doors), LACQUER),
        Part("bodies", boxes(bodies), LACQUER),
        Part("grips", boxes([*grips, *hood]), BRUSHED),
        Part("worktop", boxes([((0, BACK - 0.31, 0.885), (4.19, 0.62, 0.04))]), OAK),
        Part(
            "hob",
            boxes([((0, BACK - 0.33, 0.909), (0.56, 0.48, 0.006))]),
            glaze((0.02, 0.02, 0.02), 0.04),
        ),
        Part("plinth", boxes([((0, BACK - 0.27, 0.05), (4.19, 0.5, 0.1))]), BLACK),
    ]


def _island() -> list[Part]:
    x, y = ISLAND
    seat = [(0, 0.66), (0.16, 0.66), (0.17, 0.675), (0.16, 0.69), (0, 0.685)]
    stools, legs = [], []
    for dx in (-0.45, 0.35):
        at = (x + dx, y - 0.62)
        stools.append(turned(seat, (*at, 0.0)))
        legs += [
            ((at[0] + a, at[1] + b, 0.335), (0.025, 0.025, 0.65))
            for a in (-0.1, 0.1)
            for b in (-0.1, 0.1)
        ]
    return [
        Part("island", boxes([((x, y, 0.47), (1.6, 0.62, 0.8))]), LACQUER),
        Part("stone", boxes([((x, y, 0.89), (1.8, 0.8, 0.04))]), STONE),
        Part("stools", trimesh.util.concatenate(stools), OAK),
        Part("legs", boxes(legs), BLACK),
        Part("foot", boxes([((x, y, 0.035), (1.5, 0.52, 0.07))]), BLACK),
    ]


def _still_life() -> list[Part]:
    """A bowl of oranges, a pot, a board, bottles."""
    x, y = ISLAND
    bowl = [
        (0, 0),
        (0.05, 0),
        (0.09, 0.02),
        (0.15, 0.08),
        (0.145, 0.085),
        (0.085, 0.03),
        (0, 0.015),
    ]
    places = [(0.05, 0.02, 0.055), (-0.045, 0.03, 0.055), (0.0, -0.055, 0.055), (0.0, 0.01, 0.115)]
    fruit = [
        trimesh.creation.icosphere(subdivisions=3, radius=0.037).apply_translation(
            [x + 0.25 + a, y + 0.05 + b, 0.913 + c]
        )
        for a, b, c in places
    ]
    pot = [
        (0, 0),
        (0.1, 0),
        (0.105, 0.01),
        (0.105, 0.12),
        (0.1, 0.125),
        (0.03, 0.14),
        (0.02, 0.165),
        (0, 0.17),
    ]
    bottle = [
        (0, 0),
        (0.035, 0),
        (0.036, 0.01),
        (0.036, 0.17),
        (0.013, 0.23),
        (0.013, 0.28),
        (0, 0.28),
    ]
    bottles = [turned(bottle, (px, BACK - 0.12, 0.907)) for px in (0.72, 0.82, 0.93)]
    return [
        Part("bowl", turned(bowl, (x + 0.25, y + 0.05, 0.912)), glaze((0.7, 0.68, 0.62))),
        Part("fruit", trimesh.util.concatenate(fruit), glaze((0.75, 0.27, 0.03), 0.3)),
        Part("pot", turned(pot, (-0.12, BACK - 0.36, 0.914)), BRUSHED),
        Part("bottles", trimesh.util.concatenate(bottles), glaze((0.05, 0.14, 0.05), 0.05)),
        Part("board", boxes([((x - 0.4, y - 0.02, 0.922), (0.4, 0.26, 0.02))]), OAK),
    ]
