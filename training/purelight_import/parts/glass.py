"""Glass: whether it is a body or a thin sheet, and which way its surfaces face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import trimesh

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.mesh import Floats, Mesh
from purelight_import.parts.choice import fitting
from purelight_import.parts.hull import SIDES, Hull, hull
from purelight_import.parts.rays import Rays

SOLID, THIN = "solid", "thin"
PROBED = 64  # parts within glass, to see whether any of them is
MENDABLE = 200_000  # triangles whose winding is made consistent, which takes a while


@dataclass(frozen=True)
class Surface:
    """One closed surface of a part."""

    part: int
    number: int
    mesh: Mesh
    volume: float


def settled(lamp: Lamp, wanted: Mapping[str, str]) -> Lamp:
    """The lamp with each part of glass made a body or a sheet, and bodies turned right.

    Arguments:
        wanted: by pattern of names, `solid` or `thin`, which overrule what the file says; parts
            of another material become glass of their colour.
    """
    said = {
        id(part): kind
        for pattern, kind in wanted.items() for part in fitting(pattern, lamp.parts)
    }  # fmt: skip
    kinds = [said.get(id(part)) for part in lamp.parts]
    parts = [_as_glass(p, lamp) if k else p for p, k in zip(lamp.parts, kinds, strict=True)]
    glass = [
        i for i, p in enumerate(parts) if isinstance(p.material, Material) and p.material.glass
    ]
    hulls: dict[int, Hull] = {}
    for i in glass:
        parts[i] = _mended(parts[i], lamp)
        hulls[i] = hull(parts[i].mesh)
    others = _middles([p for i, p in enumerate(parts) if i not in hulls])
    for i in glass:
        kind = kinds[i] or _kind(parts[i], hulls[i], others, lamp)
        parts[i] = replace(parts[i], solid=kind == SOLID)
    return replace(lamp, parts=tuple(_turned(parts, hulls, lamp)))


def _as_glass(part: Part, lamp: Lamp) -> Part:
    """The part made of glass, as far as its material can be changed."""
    material = part.material
    if material.glass:
        return part
    if not isinstance(material, Material):
        lamp.notes("--glass changes no material that Mitsuba wrote itself", part.name)
        return part
    lamp.notes("made glass by --glass", part.name)
    clear = replace(material, metalness=0.0, transmission=1.0, opacity=1.0, attenuation=None)
    return replace(part, material=clear)


def _kind(part: Part, about: Hull, others: Floats, lamp: Lamp) -> str:
    """Whether a part of glass of which nobody said it is solid or thin."""
    assert isinstance(part.material, Material)
    if part.material.thin_walled:
        lamp.notes("glass without a thickness in the file is taken as thin sheets "
                   "(--glass NAME=solid makes it a body)", part.name)  # fmt: skip
        return THIN
    if not about.all_closed:
        lamp.notes("glass with open edges is taken as thin sheets", part.name)
        return THIN
    if _is_envelope(part, others):
        lamp.notes("glass that is one surface around other parts is taken as a thin shell "
                   "(--glass NAME=solid fills it)", part.name)  # fmt: skip
        return THIN
    return SOLID


def _middles(parts: list[Part]) -> Floats:
    """A point of each part: [P, 3]."""
    triangles = [p.mesh.triangles[len(p.mesh.triangles) // 2] for p in parts]
    points = [p.mesh.positions[t].mean(0) for p, t in zip(parts, triangles, strict=True)]
    return np.array(points).reshape(-1, 3)


def _is_envelope(part: Part, others: Floats) -> bool:
    """Whether other parts, of which points [P, 3] are given, stand in what would be glass."""
    low, high = part.mesh.bounds
    near = others[((others > low) & (others < high)).all(1)]
    rays = Rays.among([part.mesh])
    return any(rays.inside(point) for point in near[:PROBED])


def _mended(part: Part, lamp: Lamp) -> Part:
    """With one winding, where a closed surface has several."""
    if hull(part.mesh).all_closed or len(part.mesh.triangles) > MENDABLE:
        return part
    corners = part.mesh.welded()
    sides = np.sort(corners[:, SIDES].reshape(-1, 2), 1)
    _, count = np.unique(sides, axis=0, return_counts=True)
    if (count != 2).any():
        return part
    welded = trimesh.Trimesh(np.zeros((int(corners.max()) + 1, 3)), corners, process=False)
    trimesh.repair.fix_winding(welded)
    wrong = (corners != np.asarray(welded.faces)).any(1)
    lamp.notes("glass whose faces looked to different sides is made consistent", part.name)
    mesh = replace(part.mesh, normals=None).turned(wrong)
    return replace(part, mesh=mesh)


def _turned(parts: list[Part], hulls: dict[int, Hull], lamp: Lamp) -> list[Part]:
    """Bodies whose surfaces have glass behind them: outer ones face out, hollows' in.

    A surface within an odd number of others is a hollow's.
    """
    surfaces = [
        Surface(i, number, parts[i].mesh.only(about.surface == number), about.volume[number])
        for i, about in hulls.items() if parts[i].solid
        for number in np.flatnonzero(about.closed).tolist()
    ]  # fmt: skip
    rays: dict[int, Rays] = {}
    boxes = np.array([s.mesh.bounds for s in surfaces]).reshape(-1, 2, 3)
    for k, s in enumerate(surfaces):
        around = (boxes[:, 0] <= boxes[k, 0]).all(1) & (boxes[:, 1] >= boxes[k, 1]).all(1)
        around[k] = False
        depth = 0
        for j in np.flatnonzero(around).tolist():
            if j not in rays:
                rays[j] = Rays.among([surfaces[j].mesh])
            depth += rays[j].inside(s.mesh.positions[0])
        if (s.volume < 0) == (depth % 2 == 0):
            lamp.notes("glass that was inside out is turned", parts[s.part].name)
            parts[s.part] = _with_turned(parts[s.part], hulls[s.part], s.number)
    return parts


def _with_turned(part: Part, about: Hull, number: int) -> Part:
    """A part with one of its surfaces turned."""
    mesh = part.mesh
    if not _apart(mesh, about):
        mesh = replace(mesh, normals=None)
    return replace(part, mesh=mesh.turned(about.surface == number))


def _apart(mesh: Mesh, about: Hull) -> bool:
    """Whether no vertex belongs to two surfaces."""
    owner = np.full(len(mesh.positions), -1)
    for corner in mesh.triangles.T:
        clash = (owner[corner] >= 0) & (owner[corner] != about.surface)
        if clash.any():
            return False
        owner[corner] = about.surface
    return True
