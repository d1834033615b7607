"""Pictures on parts whose texture coordinates are not known, which nobody can place."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material, Verbatim
from purelight_import.model.picture import Picture, mean_of

NOTE = "a picture without a known place on the part; its mean was taken, of bumps none"
REPEATED = "a mesh without texture coordinates repeats its picture on every triangle, as in Mitsuba"
PAINT = "colours of vertices and faces are not taken: a material that asks for them finds black"
PICTURES, PAINTED = {"bitmap", "checkerboard"}, {"mesh_attribute"}


def placeable(lamp: Lamp) -> Lamp:
    """The lamp with the means of pictures that no coordinates place, each noted.

    Mitsuba would spread them over every triangle anew, and cannot aim at the light of one. So it
    does those of its own materials, which are taken as they are, and noted.
    """
    plain: dict[int, Material] = {}
    parts = tuple(_placed(part, plain) for part in lamp.parts)
    for before, after in zip(lamp.parts, parts, strict=True):
        if after is not before:
            lamp.notes(NOTE, before.name)
        kinds = _textures(before.material) if isinstance(before.material, Verbatim) else set()
        if before.mesh.uv is None and kinds & PICTURES:
            lamp.notes(REPEATED, before.name)
        if kinds & PAINTED:
            lamp.notes(PAINT, before.name)
    return replace(lamp, parts=parts)


def _textures(material: Verbatim) -> set[str]:
    """The kinds of textures that a material of Mitsuba uses."""
    return {
        texture.get("type", "")
        for text in material.elements for texture in ET.fromstring(text).iter("texture")
    }  # fmt: skip


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
