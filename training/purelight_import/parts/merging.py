"""Fewer parts: those of one material as one, where a file has very many."""

from __future__ import annotations

from dataclasses import replace

from purelight_import.model import limits
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.mesh import joined


def merged(lamp: Lamp) -> Lamp:
    """The lamp with at most one part for each material and light, if it has very many parts."""
    if len(lamp.parts) <= limits.MANY_PARTS:
        return lamp
    groups: dict[tuple[object, ...], list[Part]] = {}
    for part in lamp.parts:
        flat = part.mesh.normals is None
        key = (id(part.material), id(part.radiance), part.solid, flat, part.mesh.uv is None)
        groups.setdefault(key, []).append(part)
    lamp.notes(f"{len(lamp.parts)} parts are joined into {len(groups)}, by their materials")
    parts = tuple(_joined(parts) for parts in groups.values())
    return replace(lamp, parts=parts)


def _joined(parts: list[Part]) -> Part:
    if len(parts) == 1:
        return parts[0]
    name = parts[0].material.name or parts[0].name
    return replace(parts[0], name=f"{name}_{parts[0].name}"[: limits.NAME],
                   mesh=joined([p.mesh for p in parts]))  # fmt: skip
