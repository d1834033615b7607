"""A dining room: a pendant over a glass table, sconces on the wall."""

from __future__ import annotations

from dataclasses import dataclass

import trimesh

from purelight_examples.luminaires.lamp_scene import Material, Part, matt
from purelight_examples.luminaires.materials import BRUSHED, glaze
from purelight_examples.scenes.furniture import Box, boxes, turned, wall
from purelight_examples.scenes.interior import CLEAR, Interior, View, cord, hung
from purelight_examples.scenes.place import Place
from purelight_examples.scenes.surfaces import planks, shell

THIN_GLASS = Material(
    "thindielectric", {"int_ior": 1.5}, {"specular_transmittance": (0.95, 0.98, 0.96)}
)
WALNUT = glaze((0.22, 0.12, 0.065), 0.18)
BACK, TABLE = 1.8, (0.1, 0.15)


@dataclass(frozen=True)
class DiningRoom(Interior):
    """A room of 4 by 3.6 m with a table for six.

    Arguments:
        pendant: over the table, `drop` below the ceiling.
        sconce: on the far wall, on either side of the picture; none if empty.
    """

    name: str = "dining_room"
    height: float = 2.6
    pendant: str = "modern"
    drop: float = 0.45
    sconce: str = "wall_sconce"
    daylight: float = 0.0

    def view(self) -> View:
        """Over the table towards the sideboard."""
        return View((1.85, -1.7, 1.6), (-0.25, 0.85, 1.15), 66.0)

    def places(self) -> dict[str, list[Place]]:
        """The pendant, and two sconces."""
        found = {self.pendant: [hung(self.pendant, *TABLE, self.height, self.drop)]}
        if self.sconce:
            found[self.sconce] = [Place((x, BACK - CLEAR, 1.75), -90.0) for x in (-0.75, 0.95)]
        return found

    def window(self) -> trimesh.Trimesh:
        """In the wall on the left."""
        return wall((-1.99, 0.4, 1.45), 1, (0.6, 0.65))

    def parts(self) -> list[Part]:
        """Shell, table, chairs, sideboard, picture."""
        hang = cord(self.places()[self.pendant][0], self.height, self.pendant)
        frame: list[Box] = [((-1.985, 0.4 + s * 0.63, 1.45), (0.03, 0.06, 1.42)) for s in (-1, 1)]
        frame += [((-1.985, 0.4, 1.45 + s * 0.68), (0.03, 1.3, 0.06)) for s in (-1, 0, 1)]
        picture = boxes([((0.1, BACK - 0.035, 1.8), (0.95, 0.004, 0.62))])
        return [
            matt("walls", shell((-2.0, 2.0), (-1.8, BACK), self.height), (0.7, 0.68, 0.62)),
            *planks((-2.0, 2.0), (-1.8, BACK), 0.14),
            *_table(),
            *_chairs(),
            *_sideboard(),
            matt(
                "picture_frame",
                boxes([((0.1, BACK - 0.017, 1.8), (1.05, 0.03, 0.72))]),
                (0.06, 0.05, 0.04),
            ),
            matt("picture", picture, (0.55, 0.3, 0.14)),
            matt("rail", boxes([((0, BACK - 0.01, 0.95), (3.98, 0.018, 0.06))]), (0.7, 0.68, 0.62)),
            matt("window", boxes(frame), (0.72, 0.7, 0.66)),
            matt("cord", hang, (0.05, 0.05, 0.05)),
        ]


def _table() -> list[Part]:
    """A sheet of glass in a steel edge on two trestles, laid with plates and a bowl."""
    (x, y), z = TABLE, 0.75
    edge: list[Box] = [((x, y + s * 0.455, z), (1.73, 0.012, 0.018)) for s in (-1, 1)]
    edge += [((x + s * 0.859, y, z), (0.012, 0.898, 0.018)) for s in (-1, 1)]
    legs: list[Box] = []
    for s in (-1, 1):
        legs += [((x + s * 0.6, y + t * 0.3, 0.37), (0.06, 0.06, 0.72)) for t in (-1, 1)]
        legs += [
            ((x + s * 0.6, y, 0.705), (0.06, 0.54, 0.05)),
            ((x + s * 0.6, y, 0.12), (0.04, 0.54, 0.04)),
        ]
    plate = [
        (0, 0),
        (0.07, 0),
        (0.08, 0.006),
        (0.13, 0.018),
        (0.13, 0.022),
        (0.075, 0.012),
        (0, 0.008),
    ]
    plates = [
        turned(plate, (x + dx, y + s * 0.29, z + 0.003))
        for dx in (-0.52, 0.0, 0.52)
        for s in (-1, 1)
    ]
    bowl = [(0, 0), (0.06, 0), (0.05, 0.03), (0.16, 0.09), (0.155, 0.095), (0.04, 0.045), (0, 0.04)]
    return [
        Part("glass", wall((x, y, z), 3, (0.85, 0.445)), THIN_GLASS),
        Part("edge", boxes(edge), BRUSHED),
        Part("trestles", boxes(legs), WALNUT),
        Part("plates", trimesh.util.concatenate(plates), glaze((0.78, 0.77, 0.74), 0.05)),
        Part("bowl", turned(bowl, (x, y, z + 0.003)), glaze((0.1, 0.2, 0.35), 0.06)),
    ]


def _chairs() -> list[Part]:
    """Six chairs of walnut with cushions."""
    wood: list[Box] = []
    cushions: list[Box] = []
    for dx in (-0.52, 0.02, 0.56):
        for s in (-1, 1):
            x, y = TABLE[0] + dx, TABLE[1] + s * 0.66
            wood += [((x + a * 0.19, y - s * 0.19, 0.22), (0.035, 0.035, 0.44)) for a in (-1, 1)]
            wood += [((x + a * 0.19, y + s * 0.19, 0.46), (0.035, 0.035, 0.92)) for a in (-1, 1)]
            wood += [((x, y + s * 0.19, z), (0.345, 0.02, 0.06)) for z in (0.64, 0.76, 0.88)]
            cushions.append(((x, y, 0.465), (0.4, 0.34, 0.045)))
    return [
        Part("chairs", boxes(wood), WALNUT),
        matt("cushions", boxes(cushions), (0.5, 0.44, 0.36)),
    ]


def _sideboard() -> list[Part]:
    y = BACK - 0.22
    doors: list[Box] = [((0.1 + 0.5 * k, y - 0.215, 0.43), (0.49, 0.018, 0.5)) for k in (-1, 0, 1)]
    legs: list[Box] = [
        ((0.1 + a * 0.7, y + b * 0.15, 0.08), (0.04, 0.04, 0.16)) for a in (-1, 1) for b in (-1, 1)
    ]
    vase = [(0, 0), (0.05, 0), (0.09, 0.06), (0.1, 0.14), (0.03, 0.25), (0.045, 0.31), (0, 0.3)]
    balls = [
        trimesh.creation.icosphere(subdivisions=4, radius=r).apply_translation(
            [0.1 + dx, y, 0.702 + r]
        )
        for dx, r in ((0.45, 0.07), (0.58, 0.045))
    ]
    return [
        Part("sideboard", boxes([((0.1, y, 0.43), (1.52, 0.41, 0.54)), *legs]), WALNUT),
        Part("doors", boxes(doors), glaze((0.28, 0.16, 0.09), 0.18)),
        Part("vase", turned(vase, (-0.35, y, 0.702)), glaze((0.62, 0.6, 0.55), 0.3)),
        Part("balls", trimesh.util.concatenate(balls), BRUSHED),
    ]
