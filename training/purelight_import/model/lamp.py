"""A lamp as its parts."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from purelight_import.model.frame import Frame
from purelight_import.model.material import RGB, Color, Material, Verbatim
from purelight_import.model.mesh import Floats, Mesh
from purelight_import.model.notes import Notes


@dataclass(frozen=True)
class Part:
    """One mesh of one material.

    Arguments:
        name: unique within the lamp.
        path: names of the nodes and of the mesh that it comes from, which also find it.
        radiance: in W/(m² sr) if it emits.
        double_sided: whether the file says that its back is like its front.
        solid: of glass, whether it is a body (true) or a thin sheet (false).
    """

    name: str
    mesh: Mesh
    material: Material | Verbatim
    path: tuple[str, ...] = ()
    radiance: Color | None = None
    double_sided: bool = False
    solid: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """All names by which it may be chosen."""
        return (self.name, *self.path, self.material.name)


@dataclass(frozen=True)
class PointLight:
    """Light from a point, which has no radiance until it is given a size.

    Arguments:
        position, direction: [3]; spots shine along the direction.
        intensity: W/sr per channel, in the direction of a spot.
        cone: half-angles of a spot in radians, inner and outer; None shines all round.
        radius: its size if the file gives one, in the file's unit.
    """

    name: str
    position: Floats
    intensity: RGB
    direction: Floats = field(default_factory=lambda: np.array([0.0, 0.0, -1.0]))
    cone: tuple[float, float] | None = None
    path: tuple[str, ...] = ()
    radius: float | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """All names by which it may be chosen."""
        return (self.name, *self.path)


@dataclass(frozen=True)
class Lamp:
    """What a file holds of a lamp.

    Arguments:
        name: of the lamp.
        frame: the unit of its lengths and its up axis.
        room: names of lights that belong to no lamp, as skies.
    """

    name: str
    parts: tuple[Part, ...]
    points: tuple[PointLight, ...] = ()
    frame: Frame = field(default_factory=Frame)
    notes: Notes = field(default_factory=Notes)
    room: tuple[str, ...] = ()

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Least and largest coordinates of all parts and points: [2, 3]."""
        places = [p.mesh.bounds for p in self.parts] + [p.position[None] for p in self.points]
        every = np.concatenate(places)
        return np.stack((every.min(0), every.max(0)))

    def placed(self) -> Lamp:
        """In metres with +Z up."""
        matrix = self.frame.matrix
        scale = self.frame.metres
        materials = {id(p.material): p.material.moved(self.frame) for p in self.parts}
        parts = tuple(
            replace(p, mesh=p.mesh.moved(matrix), material=materials[id(p.material)])
            for p in self.parts
        )
        points = tuple(
            replace(
                p, position=matrix[:3, :3] @ p.position,
                direction=matrix[:3, :3] @ p.direction / scale,
                radius=None if p.radius is None else p.radius * scale,
            )
            for p in self.points
        )  # fmt: skip
        return replace(self, parts=parts, points=points, frame=Frame())
