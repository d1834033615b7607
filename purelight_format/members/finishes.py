"""Finishes: of what the exit surface is made, so that a lamp answers the light of a room.

A finish is a material in the words of OpenPBR and UsdPreviewSurface; `reflection` says what it
does with light. Each side of each triangle of the exit surface has one, or none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from purelight_format.issues import fail
from purelight_format.limits import LIMITS, Limits
from purelight_format.members.manifest_reader import Reader

MEMBER, DTYPE = "surface/finish.npy", "|u1"
NONE = 255  # A side of a triangle without a finish.
ENERGY_SLACK = 1e-6  # Rounding of colours that add up to one.
LEAST_IOR, LARGEST_IOR = 1.0, 4.0
LARGEST_EXPONENT = 1e6

RGB = tuple[float, float, float]
BLACK: RGB = (0.0, 0.0, 0.0)
WHITE: RGB = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Finish:
    """A material; every number is in [0, 1] unless said otherwise.

    Arguments:
        name: what people call it.
        base_color: of what is reflected diffusely; of metals, the reflectance at right angles.
        metalness: 0 for dielectrics, 1 for metals.
        specular_color: tint of the specular reflection; of metals, only toward grazing.
        roughness: square root of the GGX width.
        ior: index of refraction, 1 to 4; at 1 a dielectric has no specular reflection.
        opacity: 1 where nothing passes; below, the network `transparency` says what does.
        thin_walled: whether it is a sheet of glass with two parallel faces.
        smooth: whether normals are to be interpolated over the facets.
        diffuse_transmission: part of the light that leaves into the half-space ahead, besides
            what `transparency` says.
        spread: part of what `transparency` says that does not go straight.
        spread_exponent: k of the lobe cos^k about the straight line in which both go on.
        extra: fields this version does not know.
    """

    name: str
    base_color: RGB
    metalness: float = 0.0
    specular_color: RGB = WHITE
    roughness: float = 0.5
    ior: float = 1.5
    opacity: float = 1.0
    thin_walled: bool = False
    smooth: bool = False
    diffuse_transmission: RGB = BLACK
    spread: float = 0.0
    spread_exponent: float = 1.0
    extra: dict[str, Any] = field(default_factory=dict, compare=False)

    @property
    def opaque(self) -> bool:
        return self.opacity == 1

    @property
    def diffuse(self) -> np.ndarray:
        """Colour of what is reflected diffusely: [3]."""
        return np.array(self.base_color) * (1 - self.metalness)

    def to_json(self) -> dict[str, Any]:
        """As JSON values, without what is as by default."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "extra"}
        known = {k: v for k, v in plain.items() if k not in _DEFAULTS or v != _DEFAULTS[k]}
        return {k: list(v) if isinstance(v, tuple) else v for k, v in known.items()} | self.extra


_DEFAULTS = {f.name: getattr(Finish("", BLACK), f.name) for f in fields(Finish)[2:]}


def read(reader: Reader) -> Finish:
    """A finish from JSON; what is wrong is noted."""
    given = Finish(
        name=reader.text("name", 200),
        base_color=reader.color("base_color"),
        metalness=reader.within("metalness", 0, 1, 0.0),
        specular_color=reader.color("specular_color", WHITE),
        roughness=reader.within("roughness", 0, 1, 0.5),
        ior=reader.within("ior", LEAST_IOR, LARGEST_IOR, 1.5),
        opacity=reader.within("opacity", 0, 1, 1.0),
        thin_walled=reader.flag("thin_walled", False),
        smooth=reader.flag("smooth", False),
        diffuse_transmission=reader.color("diffuse_transmission", BLACK),
        spread=reader.within("spread", 0, 1, 0.0),
        spread_exponent=reader.within("spread_exponent", 0, LARGEST_EXPONENT, 1.0),
    )
    total = given.diffuse + given.diffuse_transmission
    if total.max() > 1 + ENERGY_SLACK:
        reader.add("PLX_MANIFEST_FINISH_ENERGY", "base_color", total=total.max())
    return replace(given, extra=reader.rest())


def require_indices(finish: np.ndarray, triangles: int, count: int) -> None:
    """Compares indices with the triangles and finishes there are.

    Arguments:
        finish: of the front and the back of each triangle, or `NONE`.

    Raises:
        FormatError: PLX_NPY_SHAPE or PLX_SURFACE_FINISH.
    """
    if finish.shape != (triangles, 2):
        fail("PLX_NPY_SHAPE", MEMBER, shape=finish.shape, expected=f"({triangles}, 2)")
    bad = np.flatnonzero(((finish >= count) & (finish != NONE)).any(1))
    if len(bad):
        fail("PLX_SURFACE_FINISH", MEMBER, triangle=bad[0], count=count)


def read_all(reader: Reader, key: str, limits: Limits = LIMITS) -> tuple[Finish, ...]:
    """The finishes of a manifest; none where it says nothing of any."""
    found = reader.listed(key, limits.finishes, "PLX_MANIFEST_FINISH_COUNT")
    return tuple(read(one) for one in found)


def to_json(finishes: Sequence[Finish]) -> dict[str, Any]:
    """The manifest's field; nothing for lamps without finishes."""
    return {"finishes": [finish.to_json() for finish in finishes]} if finishes else {}
