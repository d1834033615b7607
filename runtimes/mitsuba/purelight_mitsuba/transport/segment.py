"""Straight lines in the room, and the lamps that they meet."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Place

NONE = 0xFFFFFFFF
ANY = 0xFFFFFFFE


@dataclass
class Segment:
    """A straight line between two points of the room, or to infinity.

    Arguments:
        weight: What light along it is worth to the pixel. A shadow ray's weight includes the
            light at its end, except toward a lamp whose radiance is only known on its surface.
        lamp: The lamp a shadow ray leads to, or NONE.
        facet: The triangle of the lamp whose light counts, or ANY; NONE if its light is known.
        open: Whether the known light arrives although no lamp is met.
        own: The lamp that it starts from, or NONE.
        skip: A lamp that it has behind itself already, or NONE.
        shone: A lamp whose light counts already, since it goes straight on from where that was met.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    length: mi.Float
    weight: mi.Color3f
    lamp: mi.UInt32
    facet: mi.UInt32
    open: mi.Bool
    active: mi.Bool
    own: mi.UInt32
    skip: mi.UInt32
    shone: mi.UInt32

    @staticmethod
    def of(
        ray: mi.Ray3f,
        length: mi.Float,
        weight: mi.Color3f,
        active: mi.Bool,
        *,
        lamp: int | mi.UInt32 = NONE,
        facet: int | mi.UInt32 = NONE,
        open: bool | mi.Bool = False,
        own: int | mi.UInt32 = NONE,
        skip: int | mi.UInt32 = NONE,
        shone: int | mi.UInt32 = NONE,
    ) -> Segment:
        return Segment(
            ray.o, ray.d, length, weight, mi.UInt32(lamp), mi.UInt32(facet), mi.Bool(open),
            mi.Bool(active), mi.UInt32(own), mi.UInt32(skip), mi.UInt32(shone),
        )  # fmt: skip

    @staticmethod
    def none() -> Segment:
        """A segment that is never walked."""
        zero = mi.Color3f(0)
        return Segment.of(dr.zeros(mi.Ray3f), mi.Float(0), zero, mi.Bool(False))


@dataclass
class Meeting:
    """The next lamp that a segment meets.

    Arguments:
        hit: Where, from the point up to which the segment has been walked.
        place: Of the lamp.
        group: Its light group.
        distance: From the segment's origin.
        point: In the world.
        fresh: Whether the segment has not passed the lamp before.
        unseen: Whether its light does not count yet.
        target: Whether a shadow ray leads to the lamp.
        seen: Whether it leads to this part of the lamp.
    """

    hit: Hit
    place: Place
    group: mi.UInt32
    distance: mi.Float
    point: mi.Point3f
    fresh: mi.Bool
    unseen: mi.Bool
    target: mi.Bool
    seen: mi.Bool
