"""Vertices that wait until their shadow rays are sent."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.transport.aimed import Numbers
from purelight_mitsuba.transport.segment import NONE

CAPACITY = 1 << 22  # Vertices that may wait at the same time, of 100 bytes each.


@dataclass
class Waiting:
    """A vertex that has yet to aim at a lamp.

    Arguments:
        origin, direction: The ray that found it.
        found: What the ray hit.
        throughput: Of the path up to here.
        lane: Of the path.
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    found: mi.PreliminaryIntersection3f
    throughput: mi.Color3f
    numbers: Numbers
    lane: mi.UInt32


@dataclass
class Slot:
    """Where a path's next vertex will wait, or NONE."""

    index: mi.UInt32


class Queue:
    """Vertices that wait, in a bounded part of the memory.

    An active path owns one free slot, and takes the next when it has filled that. A path that finds
    none left pauses until the queue has been emptied, so that no vertex is ever lost.

    Arguments:
        lanes: How many paths there are.
    """

    def __init__(self, lanes: int) -> None:
        self.lane, self._capacity = dr.arange(mi.UInt32, lanes), CAPACITY
        self._vertices = dr.empty(Waiting, self._capacity)

    def open(self, active: mi.Bool) -> Slot:
        """Forgets what waits, and returns a slot for every active path."""
        self._filled = dr.zeros(mi.Bool, self._capacity)
        self._next = mi.UInt32(0)
        dr.make_opaque(self._vertices, self._filled, self._next)
        slot = self.reserve(Slot(mi.UInt32(NONE)), active & (self.lane < len(self.lane)))
        dr.eval(slot)  # It must not be counted again where it is used.
        return slot

    def reserve(self, slot: Slot, active: mi.Bool) -> Slot:
        """Gives active paths without a slot the next one."""
        wanted = active & (slot.index == NONE)
        own = dr.scatter_inc(self._next, mi.UInt32(0), wanted)
        return Slot(dr.select(wanted, own, slot.index))

    def served(self, slot: Slot) -> mi.Bool:
        """Whether paths need not pause."""
        return (slot.index == NONE) | (slot.index < self._capacity)

    def push(self, vertex: Waiting, slot: Slot, active: mi.Bool) -> None:
        """Stores vertices in the slots of their paths, which then own none."""
        dr.scatter(self._vertices, vertex, slot.index, active)
        dr.scatter(self._filled, True, slot.index, active)
        slot.index = dr.select(active, NONE, slot.index)

    def take(self) -> Waiting | None:
        """Returns the vertices that wait, if there are any."""
        dr.eval(self._vertices, self._filled)
        index = dr.compress(self._filled)
        return dr.gather(Waiting, self._vertices, index) if len(index) else None
