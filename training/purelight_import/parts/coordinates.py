"""Pictures on parts whose texture coordinates are not known, which nobody can place."""

from __future__ import annotations

from dataclasses import replace

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material, Verbatim
from purelight_import.model.picture import Picture, mean_of

NOTE = "a picture without a known place on the part; its mean was taken, of bumps none"


def placeable(lamp: Lamp) -> Lamp:
    """The lamp with the means of pictures that no coordinates place, each noted.

    Mitsuba would spread them over every triangle anew, as it does those of materials that are
    taken as they are in its own files, and cannot aim at the light of one.
    """
    plain: dict[int, Material] = {}
    parts = tuple(_placed(part, plain) for part in lamp.parts)
    for before, after in zip(lamp.parts, parts, strict=True):
        if after is not before:
            lamp.notes(NOTE, before.name)
    return replace(lamp, parts=parts)


def _placed(part: Part, plain: dict[int, Material]) -> Part:
    """The part itself if there is nothing to place.

    Arguments:
        plain: materials by the identity of the pictured ones; parts of one keep one in common.
    """
    if part.mesh.uv is not None:
        return part
    if isinstance(part.radiance, Picture):
        part = replace(part, radiance=mean_of(part.radiance))
    material = part.material
    if isinstance(material, Verbatim) or not material.pictures:
        return part
    if id(material) not in plain:
        means = {name: mean_of(value) for name, value in material.pictures.items()}
        plain[id(material)] = replace(material, **(means | {"normal": None}))
    return replace(part, material=plain[id(material)])
