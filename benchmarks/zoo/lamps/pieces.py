"""What a lamp's scene is made of: bodies with a finish, and lights without a body."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks.zoo.lamps.forms import Mesh, Primitive
from benchmarks.zoo.lamps.placement import Floats, Placement, apply
from benchmarks.zoo.lamps.plugin import RGB, plugin, point, scale_bumps, transform

Pixels = NDArray[np.uint8]
Textures = dict[str, Pixels]  # by file name, without folder


@dataclass(frozen=True)
class Medium:
    """A homogeneous medium.

    Arguments:
        extinction: per unit of length, each channel up to one; multiplied by `density`.
        albedo: part of it that is scattered.
    """

    extinction: RGB
    density: float
    albedo: RGB = (0.0, 0.0, 0.0)

    def element(self, scale: float) -> ET.Element:
        """As XML, where a unit of length is `scale` metres."""
        return plugin(
            "medium", "homogeneous", sigma_t=self.extinction, scale=self.density / scale,
            albedo=self.albedo,
        )  # fmt: skip


@dataclass(frozen=True)
class Finish:
    """A material: its BSDF, the medium inside, its textures, and words that tell what it is."""

    bsdf: ET.Element
    traits: frozenset[str]
    medium: Medium | None = None
    textures: Textures = field(default_factory=dict)

    def placed(self, scale: float) -> ET.Element:
        """The BSDF where a unit of length is `scale` metres: bumps have a height."""
        element = copy.deepcopy(self.bsdf)
        scale_bumps(element, scale)
        return element


@dataclass(frozen=True)
class Piece:
    """A body of a lamp.

    Arguments:
        radiance: W/(m² sr) if it shines; a texture's element where that varies.
        solid: whether its walls are closed and their normals leave what it is made of.
    """

    name: str
    form: Mesh | Primitive
    finish: Finish
    radiance: RGB | ET.Element | None = None
    solid: bool = True

    def moved(self, matrix: Floats) -> Piece:
        return replace(self, form=self.form.moved(matrix))

    def named(self, name: str) -> Piece:
        return replace(self, name=name)

    @property
    def triangles(self) -> trimesh.Trimesh:
        return self.form.triangles

    def element(self, filename: str, placement: Placement, *, lit: bool) -> ET.Element:
        """The piece as a Mitsuba shape; meshes are in `filename`, placed already."""
        if isinstance(self.form, Mesh):
            shape = plugin("shape", "ply", filename=filename, face_normals=not self.form.smooth)
        else:
            shape = plugin("shape", self.form.kind, flip_normals=self.form.flipped)
            shape.append(transform(placement.matrix @ self.form.matrix))
        shape.set("id", self.name)
        shape.append(self.finish.placed(placement.scale))
        if self.finish.medium is not None:
            medium = self.finish.medium.element(placement.scale)
            medium.set("name", "interior")
            shape.append(medium)
        if self.radiance is not None and lit:
            shape.append(plugin("emitter", "area", radiance=self.radiance))
        return shape


@dataclass(frozen=True)
class Light:
    """A point light, or a spot with a direction; `intensity` in W/sr for a lamp in metres."""

    name: str
    at: Floats
    intensity: RGB
    aim: Floats | None = None
    cutoff: float = 40.0

    def moved(self, matrix: Floats) -> Light:
        turn = matrix.copy()
        turn[:3, 3] = 0
        aim = None if self.aim is None else apply(turn, self.aim[None])[0]
        return replace(self, at=apply(matrix, self.at[None])[0], aim=aim)

    def named(self, name: str) -> Light:
        return replace(self, name=name)

    def element(self, placement: Placement) -> ET.Element:
        """The emitter as XML; intensity grows with the square of the size, as a body's does."""
        at = placement.points(self.at[None])[0]
        r, g, b = (c * placement.scale**2 for c in self.intensity)
        if self.aim is None:
            light = plugin("emitter", "point", intensity=(r, g, b))
            light.append(point("position", at))
        else:
            aim = placement.directions(self.aim[None])[0]
            light = plugin(
                "emitter", "spot", intensity=(r, g, b), cutoff_angle=self.cutoff,
                beam_width=0.75 * self.cutoff,
            )  # fmt: skip
            light.append(_look(at, aim / np.linalg.norm(aim), placement.scale))
        light.set("id", self.name)
        return light


Part = Piece | Light


def moved(parts: Iterable[Part], matrix: Floats, prefix: str = "") -> list[Part]:
    """Parts carried along by a similarity [4, 4], with names that begin with `prefix`."""
    return [part.moved(matrix).named(prefix + part.name) for part in parts]


def _look(at: Floats, aim: Floats, scale: float) -> ET.Element:
    element = ET.Element("transform", name="to_world")
    up = np.eye(3)[np.argmin(np.abs(aim))]
    words = {
        name: ", ".join(f"{v:.9g}" for v in value)
        for name, value in (("origin", at), ("target", at + scale * aim), ("up", up))
    }
    ET.SubElement(element, "lookat", words)
    return element
