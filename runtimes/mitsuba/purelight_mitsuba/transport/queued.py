"""The engine `queued`: paths note where they would aim at a lamp, and networks answer in batches.

What a shadow ray toward a lamp brings enters the pixel linearly and steers no path. So the symbolic
loop over paths only stores the vertices, without gaps; afterwards their networks run on packets in
which every lane has work. What a path sees, and transmittance, which steers it, stay in the loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.transport.aimed import AimedLamps, Numbers
from purelight_mitsuba.transport.answers import Answers
from purelight_mitsuba.transport.engine import Bounce, Engine
from purelight_mitsuba.transport.light import Light
from purelight_mitsuba.transport.queue import Queue, Slot, Waiting
from purelight_mitsuba.transport.segment import Segment
from purelight_mitsuba.transport.state import Path, Vertex
from purelight_mitsuba.transport.walk import Walk

ROULETTE = 2.0  # Shadow rays toward lamps, per throughput; least cost times variance in a room.


class Queued(Engine):
    """Aims at lamps later, when many vertices wait.

    Arguments:
        aimed: Aims.
        walk: Follows shadow rays.
        luminaires: The bundles of the lamps that they lead to.
    """

    lanes = 1 << 21  # About 200 bytes each.

    def __init__(self, aimed: AimedLamps, walk: Walk, luminaires: Sequence[Luminaire]) -> None:
        self._aimed, self._walk, self._answers = aimed, walk, Answers(luminaires)

    def follow(self, scene: mi.Scene, bounce: Bounce, path: Path, sampler: mi.Sampler) -> Path:
        """Traces paths as far as the queue goes, empties it, and goes on until all have ended."""
        queue, groups = Queue(dr.width(path.ray)), len(path.light.groups)
        path = _stored(path, sampler)
        light, pending = Light.dark(groups), path.pending()
        while dr.any(pending):
            path, sampler = self._fill(queue, bounce, path, sampler)
            pending = path.pending()
            sampler.schedule_state()
            dr.eval(path, pending)
            light = light + self._empty(queue, scene, groups)
        path.light = path.light + light
        return path

    def _fill(
        self, queue: Queue, bounce: Bounce, path: Path, sampler: mi.Sampler
    ) -> tuple[Path, mi.Sampler]:
        """Lets paths bounce to their end, or until there is no room in the queue."""

        def body(path: Path, slot: Slot, sampler: mi.Sampler) -> tuple[Path, Slot, mi.Sampler]:
            path = bounce(path, sampler, partial(self._wait, queue, slot))
            return path, queue.reserve(slot, path.active), sampler

        path, _, sampler = dr.while_loop(
            (path, queue.open(path.active), sampler),
            lambda path, slot, _: path.pending() & queue.served(slot),
            body,
            label="PureLight paths",
        )
        return path, sampler

    def _wait(
        self, queue: Queue, slot: Slot, path: Path, vertex: Vertex, sampler: mi.Sampler,
        active: mi.Bool,
    ) -> list[Segment]:  # fmt: skip
        """Leaves aiming at a lamp for later, by roulette where it would be worth little."""
        worth = dr.max(path.throughput) * dr.square(path.eta)
        chance = dr.minimum(worth * ROULETTE, 1)
        active = active & (sampler.next_1d() < chance)
        throughput, numbers = path.throughput / chance, Numbers.draw(sampler)
        ray, found = vertex.ray, vertex.found
        queue.push(Waiting(ray.o, ray.d, found, throughput, numbers, queue.lane), slot, active)
        return []

    def _vertex(self, waiting: Waiting) -> Vertex:
        ray = mi.Ray3f(waiting.origin, waiting.direction)
        return Vertex.of(ray, waiting.found, self._aimed.lamps)

    def _empty(self, queue: Queue, scene: mi.Scene, groups: int) -> Light:
        """Sends the shadow rays of the vertices that wait: their light for each path."""
        light, waiting = Light.dark(groups, len(queue.lane)), queue.take()
        if waiting is None:
            return light
        vertex = self._vertex(waiting)
        everywhere, numbers = mi.Bool(True), waiting.numbers
        shot = self._aimed.aim(scene, vertex, waiting.throughput, numbers, everywhere)
        (segment,) = shot.segments
        end = self._walk.ask(segment)
        brought = end.light.spoil(shot.spoilt)
        dr.eval(brought, end.question, waiting.lane)  # In one, for both are of one walk
        light.scatter(brought, waiting.lane)
        self._answers.add(light, end.question, waiting.lane)
        return light


def _stored(path: Path, sampler: mi.Sampler) -> Path:
    """The paths with all of their state in memory, a number a lane, as when they have paused.

    So the first round of tracing has the kernel of the others, and none of it is compiled twice.
    """
    everywhere = dr.opaque(mi.Bool, True, dr.width(path.ray))
    path = dr.select(everywhere, path, dr.opaque(path))
    sampler.schedule_state()
    dr.eval(path)
    return path
