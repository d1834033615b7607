"""Glass: whether it is a body or a thin sheet, and which way its surfaces face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import trimesh

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Material
from purelight_import.model.mesh import Mesh
from purelight_import.parts.choice import matches
from purelight_import.parts.hull import Hull, hull
from purelight_import.parts.rays import Rays

SOLID, THIN = "solid", "thin"
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
        wanted: by pattern of names, `solid` or `thin`, which overrule what the file says.
    """
    parts = list(lamp.parts)
    glass = [
        i for i, p in enumerate(parts) if isinstance(p.material, Material) and p.material.glass
    ]
    hulls: dict[int, Hull] = {}
    for i in glass:
        parts[i] = _mended(parts[i], lamp)
        hulls[i] = hull(parts[i].mesh)
    others = [p for i, p in enumerate(parts) if i not in glass]
    for i in glass:
        kind = _kind(parts[i], hulls[i], others, wanted, lamp)
        parts[i] = replace(parts[i], solid=kind == SOLID)
    return replace(lamp, parts=tuple(_turned(parts, hulls, lamp)))


def _kind(
    part: Part, about: Hull, others: list[Part], wanted: Mapping[str, str], lamp: Lamp
) -> str:
    """Whether a part of glass is solid or thin."""
    said = [kind for pattern, kind in wanted.items() if matches(pattern, part)]
    assert isinstance(part.material, Material)
    if said:
        return said[-1]
    if part.material.thin_walled:
        lamp.notes("glass without a thickness in the file is taken as thin sheets "
                   "(--glass NAME=solid makes it a body)", part.name)  # fmt: skip
        return THIN
    if not about.all_closed:
        lamp.notes("glass with open edges is taken as thin sheets", part.name)
        return THIN
    if _is_envelope(part, about, others):
        lamp.notes("glass that is one surface around other parts is taken as a thin shell "
                   "(--glass NAME=solid fills it)", part.name)  # fmt: skip
        return THIN
    return SOLID


def _is_envelope(part: Part, about: Hull, others: list[Part]) -> bool:
    """Whether other parts stand in what would be solid glass."""
    rays = Rays.among([part.mesh])
    low, high = part.mesh.bounds
    for other in others:
        middle = other.mesh.corners[len(other.mesh.triangles) // 2].mean(0)
        if ((middle > low) & (middle < high)).all() and rays.inside(middle):
            return True
    return False


def _mended(part: Part, lamp: Lamp) -> Part:
    """With one winding, where a closed surface has several."""
    if hull(part.mesh).all_closed or len(part.mesh.triangles) > MENDABLE:
        return part
    corners = part.mesh.welded()
    sides = np.sort(corners[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), 1)
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
        Surface(i, number, _only(parts[i].mesh, about.surface == number), about.volume[number])
        for i, about in hulls.items() if parts[i].solid
        for number in np.flatnonzero(about.closed).tolist()
    ]  # fmt: skip
    rays = [Rays.among([s.mesh]) for s in surfaces]
    for s in surfaces:
        depth = sum(
            _within(s.mesh, other.mesh) and ray.inside(s.mesh.positions[0])
            for other, ray in zip(surfaces, rays, strict=True) if other is not s
        )  # fmt: skip
        if (s.volume < 0) == (depth % 2 == 0):
            lamp.notes("glass that was inside out is turned", parts[s.part].name)
            mesh = parts[s.part].mesh
            if hulls[s.part].closed.size > 1:
                mesh = replace(mesh, normals=mesh.normals if _apart(mesh, hulls[s.part]) else None)
            parts[s.part] = replace(
                parts[s.part], mesh=mesh.turned(hulls[s.part].surface == s.number)
            )
    return parts


def _within(inner: Mesh, outer: Mesh) -> bool:
    return bool(
        (inner.bounds[0] >= outer.bounds[0]).all() and (inner.bounds[1] <= outer.bounds[1]).all()
    )


def _apart(mesh: Mesh, about: Hull) -> bool:
    """Whether no vertex belongs to two surfaces."""
    owner = np.full(len(mesh.positions), -1)
    for corner in mesh.triangles.T:
        clash = (owner[corner] >= 0) & (owner[corner] != about.surface)
        if clash.any():
            return False
        owner[corner] = about.surface
    return True


def _only(mesh: Mesh, which: np.ndarray) -> Mesh:
    used, triangles = np.unique(mesh.triangles[which], return_inverse=True)
    return Mesh(mesh.positions[used], triangles.reshape(-1, 3).astype(np.uint32))
