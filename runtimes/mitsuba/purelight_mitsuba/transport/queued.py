"""The engine `queued`: paths note where they would aim at a lamp, and networks answer in batches.

What a shadow ray toward a lamp brings enters the pixel linearly and steers no path. So the symbolic
loop over paths only stores the vertices, without gaps; afterwards their networks run on packets in
which every lane has work. What a path sees, and transmittance, which steers it, stay in the loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.transport.aimed import AimedLamps, Numbers
from purelight_mitsuba.transport.answers import Answers
from purelight_mitsuba.transport.light import Light
from purelight_mitsuba.transport.walk import NONE, Walk

CAPACITY = 1 << 22  # Vertices that may wait at the same time, of 100 bytes each.


@dataclass
class Waiting:
    """A vertex that has yet to aim at a lamp.

    Arguments:
        origin, direction: The ray that found it.
        found: What the ray hit.
        throughput: Of the path up to here.
        lane: Of the path.
        spoilt: How many answers of networks were spoilt.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    found: mi.PreliminaryIntersection3f
    throughput: mi.Color3f
    numbers: Numbers
    lane: mi.UInt32
    spoilt: mi.UInt32


class Queue:
    """Vertices that wait, in a bounded part of the memory.

    An active path owns one free slot, and takes the next when it has filled that. A path that finds
    none left pauses until the queue has been emptied, so that no vertex is ever lost.

    Arguments:
        lanes: How many paths there are.
        capacity: How many vertices may wait.
    """

    def __init__(self, lanes: int, capacity: int | None = None) -> None:
        self.lane = dr.arange(mi.UInt32, lanes)
        self._capacity = CAPACITY if capacity is None else capacity
        self._vertices = dr.empty(Waiting, self._capacity)

    def open(self, active: mi.Bool) -> mi.UInt32:
        """Forgets what waits, and returns a slot for every active path."""
        self._filled = dr.zeros(mi.Bool, self._capacity)
        self._next = mi.UInt32(0)
        dr.make_opaque(self._vertices, self._filled, self._next)
        slot = self.reserve(mi.UInt32(NONE), active & (self.lane < len(self.lane)))
        dr.eval(slot)  # It must not be counted again where it is used.
        return slot

    def reserve(self, slot: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """Gives active paths without a slot the next one."""
        wanted = active & (slot == NONE)
        return dr.select(wanted, dr.scatter_inc(self._next, mi.UInt32(0), wanted), slot)

    def served(self, slot: mi.UInt32) -> mi.Bool:
        """Whether paths need not pause."""
        return (slot == NONE) | (slot < self._capacity)

    def push(self, vertex: Waiting, slot: mi.UInt32, active: mi.Bool) -> mi.UInt32:
        """Stores vertices in the slots of their paths."""
        dr.scatter(self._vertices, vertex, slot, active)
        dr.scatter(self._filled, True, slot, active)
        return dr.select(active, NONE, slot)

    def take(self) -> Waiting | None:
        """Returns the vertices that wait, if there are any."""
        dr.eval(self._vertices, self._filled)
        index = dr.compress(self._filled)
        return dr.gather(Waiting, self._vertices, index) if len(index) else None


class ShadowRays:
    """Sends the shadow rays of vertices that waited.

    Arguments:
        aimed: Aims them.
        walk: Follows them.
        luminaires: The bundles of the lamps that they lead to.
    """

    def __init__(self, aimed: AimedLamps, walk: Walk, luminaires: Sequence[Luminaire]) -> None:
        self._aimed, self._walk, self._answers = aimed, walk, Answers(luminaires)

    def __call__(self, scene: mi.Scene, queue: Queue, groups: int) -> tuple[Light, int]:
        """Empties a queue.

        Returns:
            Light for each path, and how many answers of networks were spoilt.
        """
        light, vertex = Light.dark(groups, len(queue.lane)), queue.take()
        if vertex is None:
            return light, 0
        ray = mi.Ray3f(vertex.origin, vertex.direction)
        si = vertex.found.compute_surface_interaction(ray, mi.RayFlags.All)
        bsdf, everywhere = si.bsdf(ray), mi.Bool(True)
        (segment,) = self._aimed.aim(scene, si, bsdf, vertex, vertex.numbers, everywhere)
        known, question, spoilt = self._walk.ask(segment)
        light.scatter_all(known, vertex.lane)
        spoilt = spoilt + vertex.spoilt
        dr.eval(light, question, vertex.lane, spoilt)
        more = self._answers.add(light, question, vertex.lane)
        return light, int(dr.sum(spoilt)[0]) + more
