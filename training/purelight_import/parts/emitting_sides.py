"""Which side of an emitter shines: the outside of a hull, one or both sides of a sheet."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Verbatim
from purelight_import.parts.hull import hull
from purelight_import.parts.rays import LIFT, Rays, leaving

RAYS = 2048
CUPPED = 0.5  # share of a side's rays that meet the part again, from which on it is a hull
MORE_OPEN = 4.0  # than the front: a back that a sheet should rather shine from
COVERED, GAP = 0.9, 0.01  # share of a side's rays that end within so much of the lamp's extent


def facing_out(lamp: Lamp, emitting: Collection[int]) -> list[tuple[Part, ...]]:
    """For each part, itself; those that emit are turned so that their fronts shine outwards.

    What is double-sided and no hull gets a second part for its back, unless that is covered, as a
    panel's by its housing.

    Arguments:
        emitting: the numbers of the parts that do.
    """
    rays = Rays.among([p.mesh for p in lamp.parts])
    return [
        tuple(_sides(part, rays, lamp))
        if number in emitting and not isinstance(part.material, Verbatim)
        else (part,)
        for number, part in enumerate(lamp.parts)
    ]


def _sides(part: Part, rays: Rays, lamp: Lamp) -> list[Part]:
    """An emitter as one part or two."""
    surfaces = hull(part.mesh)
    inverted = (surfaces.closed & (surfaces.volume < 0))[surfaces.surface]
    if inverted.any():
        lamp.notes("emitters that shone inwards are turned", part.name)
        part = replace(part, mesh=_flat(part).mesh.turned(inverted))
    if surfaces.all_closed:
        return [part]
    own = Rays.among([part.mesh])
    front, back = (_cupped(part, own, side) for side in (1, -1))
    if front > CUPPED > back:
        lamp.notes("emitters that shone inwards are turned", part.name)
        return [replace(part, mesh=part.mesh.turned())]
    if back > CUPPED:
        return [part]
    return _both(part, rays) if part.double_sided else [_to_the_open(part, rays, lamp)]


def _to_the_open(part: Part, rays: Rays, lamp: Lamp) -> Part:
    """A sheet that shines to one side: to the other one, if only from there light gets away."""
    front, back = (_free(part, rays, side) for side in (1, -1))
    if back <= MORE_OPEN * front:
        return part
    lamp.notes("emitters that shone inwards are turned", part.name)
    return replace(part, mesh=part.mesh.turned())


def _both(part: Part, rays: Rays) -> list[Part]:
    """A sheet that shines to both sides, or to the one that is not covered."""
    covered = [_covered(part, rays, side) > COVERED for side in (1, -1)]
    turned = replace(part, mesh=part.mesh.turned())
    if covered[1]:
        return [part]
    if covered[0]:
        return [turned]
    return [part, replace(turned, name=f"{part.name}_back")]


def _flat(part: Part) -> Part:
    """Without normals, which turned and other triangles might share."""
    return replace(part, mesh=replace(part.mesh, normals=None))


def _cupped(part: Part, own: Rays, side: int) -> float:
    """Share of the rays from one side that meet the part itself."""
    origin, direction = leaving(part, RAYS, side, LIFT * own.extent)
    return float(np.isfinite(own.distances(origin, direction)).mean())


def _free(part: Part, rays: Rays, side: int) -> float:
    """Share of the rays from one side that meet nothing."""
    origin, direction = leaving(part, RAYS, side, LIFT * rays.extent)
    return float(np.isinf(rays.distances(origin, direction)).mean())


def _covered(part: Part, rays: Rays, side: int) -> float:
    """Share of the rays from one side that end at once."""
    origin, direction = leaving(part, RAYS, side, LIFT * rays.extent)
    return float((rays.distances(origin, direction) < GAP * rays.extent).mean())
