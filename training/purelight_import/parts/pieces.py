"""Parts taken apart into the pieces that do not touch: a lamp that is one mesh of one material."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.mesh import Mesh
from purelight_import.model.names import Names
from purelight_import.parts.choice import chosen
from purelight_import.parts.hull import surfaces

OPTION = "--pieces"
ALONE = 999  # pieces of a part that are parts of their own; the smaller ones are one


def taken_apart(lamp: Lamp, patterns: Sequence[str]) -> Lamp:
    """The lamp with each part that a pattern fits as its unconnected pieces, the largest first.

    Pieces of `lamp` are called `lamp.1`, `lamp.2`, and so on; its name still means all of them.

    Raises:
        PureLightError: a pattern fits nothing, or there are more pieces than parts may be.
    """
    wanted = {id(part) for pattern in patterns for part in chosen(pattern, lamp.parts, OPTION)}
    names = Names({part.name.lower() for part in lamp.parts})
    parts: list[Part] = []
    for part in lamp.parts:
        parts += _pieces(part, names, lamp) if id(part) in wanted else [part]
        if len(parts) > limits.PARTS:
            raise PureLightError(f"{OPTION}: more than {limits.PARTS:,} pieces; name fewer parts")
    return replace(lamp, parts=tuple(parts))


def advice(parts: Sequence[Part]) -> str:
    """The end of a line that tells to take the part of most pieces apart; empty if none has two."""
    counts = {part.name: surfaces(part.mesh)[0] for part in parts}
    most = max(counts, key=lambda name: counts[name], default="")
    if not most or counts[most] == 1:
        return ""
    return f"; '{most}' is {counts[most]} pieces that do not touch: {OPTION} '{most}' parts them"


def _pieces(part: Part, names: Names, lamp: Lamp) -> Iterator[Part]:
    meshes = list(_by_size(part.mesh))
    if len(meshes) == 1:
        lamp.notes(f"{OPTION} leaves what is one piece", part.name)
        yield part
        return
    lamp.notes(f"taken apart by {OPTION}", f"{part.name}: {len(meshes)}")
    if len(meshes) > ALONE:
        lamp.notes(f"all pieces but the {ALONE} largest are one part", part.name)
    path = tuple(dict.fromkeys((*part.path, part.name)))
    for number, mesh in enumerate(meshes, 1):
        base = f"{part.name[: limits.NAME - 8]}.{number}"
        yield replace(part, name=names.fresh(base), mesh=mesh, path=path)


def _by_size(mesh: Mesh) -> Iterator[Mesh]:
    """The unconnected pieces, by the diagonals of their boxes; the smallest of many as one."""
    number, label = surfaces(mesh)
    low, high = np.full((number, 3), np.inf), np.full((number, 3), -np.inf)
    for corner in mesh.triangles.T:
        np.minimum.at(low, label, mesh.positions[corner])
        np.maximum.at(high, label, mesh.positions[corner])
    rank = np.empty(number, np.int64)
    rank[np.argsort(-np.linalg.norm(high - low, axis=1), kind="stable")] = np.arange(number)
    place = np.minimum(rank[label], ALONE)
    order = np.argsort(place, kind="stable")
    ends = np.flatnonzero(np.diff(place[order])) + 1
    yield from (mesh.only(which) for which in np.split(order, ends))
