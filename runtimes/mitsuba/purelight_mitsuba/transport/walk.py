"""Rays among the lamps: what they emit and let through, up to the first surface of the room."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Lamps, Place
from purelight_mitsuba.transport.aimed import AimedLamps
from purelight_mitsuba.transport.events import Parts, Stop
from purelight_mitsuba.transport.light import OTHERS, Light
from purelight_mitsuba.transport.queries import Answer, ExitRay, Queries
from purelight_mitsuba.transport.segment import ANY, NONE, Meeting, Segment
from purelight_mitsuba.transport.state import Departure
from purelight_mitsuba.transport.transmittance import Transmittance


@dataclass
class Question:
    """A ray of an exit surface whose radiance is to be known.

    Arguments:
        weight: What the radiance is worth to the pixel.
        asset: Index of the luminaire.
        group: Light group of the lamp.
    """

    ray: ExitRay
    weight: mi.Color3f
    asset: mi.UInt32
    group: mi.UInt32
    asked: mi.Bool


@dataclass
class Progress:
    """How far the segments of a lane have been walked, and what was found.

    Arguments:
        turn: Which of them is walked.
        start: How far.
        last: The lamp met last, or NONE.
        passed: Bits of the lamps behind (`Place`); `shone`: of those whose light counts.
        within: The lamp that the first segment has met, in whose sphere it ends, or NONE.
        through: Transmittance up to here.
        light: For the pixel.
        survived: Transmittance of the first segment.
        question: What is left to ask.
        stops: Where a path's own segment ends at a lamp; empty in scenes without finishes.
    """

    turn: mi.UInt32
    start: mi.Float
    last: mi.UInt32
    passed: mi.UInt64
    shone: mi.UInt64
    within: mi.UInt32
    through: mi.Color3f
    light: Light
    survived: mi.Color3f
    question: Question
    stops: list[Stop]

    @staticmethod
    def begin(groups: int, stops: list[Stop]) -> Progress:
        return Progress(
            mi.UInt32(0), mi.Float(0), mi.UInt32(NONE), mi.UInt64(0), mi.UInt64(0),
            mi.UInt32(NONE), mi.Color3f(1), Light.dark(groups), mi.Color3f(1), dr.zeros(Question),
            stops,
        )  # fmt: skip


@dataclass
class FarWall:
    """The far wall of a hollow lamp, behind where it was met.

    Arguments:
        distance: From the segment's origin.
        reflectance: Zero where there is none.
    """

    hit: Hit
    distance: mi.Float
    reflectance: mi.Color3f


Shine = Callable[[Progress, Segment, Meeting], Progress]


class Walk:
    """Walks segments through the lamps, all kinds in one loop: networks are traced only once."""

    def __init__(self, lamps: Lamps, queries: Queries, aimed: AimedLamps) -> None:
        self.lamps, self._queries, self._aimed = lamps, queries, aimed
        self._transmittance = Transmittance(lamps, queries)

    def __call__(
        self, view: Segment, departure: Departure, shadow_rays: Sequence[Segment],
        sampler: mi.Sampler,
    ) -> Progress:  # fmt: skip
        """Follows a path's own segment and the shadow rays of its last vertex.

        Arguments:
            view: Up to the room's next surface; sees every lamp on the way.
            departure: How its direction was found.
            sampler: Says whether the path goes through a lamp with finishes, or ends there.
        """
        stops = [Stop.none(sampler.next_1d())] if self.lamps.finished else []
        return self._follow([view, *shadow_rays], partial(self._shine, departure), stops)

    def ask(self, aimed: Segment) -> Progress:
        """Follows a shadow ray to a lamp, whose radiance becomes a question."""
        return self._follow([aimed], self._ask, [])

    def _follow(self, segments: Sequence[Segment], shine: Shine, stops: list[Stop]) -> Progress:
        def body(now: Progress) -> tuple[Progress]:
            return (self._step(now, _choose(segments, now.turn), shine),)

        (end,) = dr.while_loop(
            (Progress.begin(len(self.lamps.groups), stops),),
            lambda now: now.turn < len(segments),
            body,
            label="walk among the lamps",
        )
        return end

    def _step(self, now: Progress, on: Segment, shine: Shine) -> Progress:
        """Walks a segment up to behind its next lamp, or to its end."""
        # Find the next lamp
        met = self._meet(now, on)

        # What it adds: light that is known already, or its radiance
        known = dr.select(met.target & (on.facet == NONE), now.through * on.weight, 0)
        now = shine(replace(now, light=now.light.add(known, met.group)), on, met)

        # What it lets through, which a shadow ray does not ask of the lamp it leads to; of a lamp
        # with another one between its parts, that is asked part by part
        passing = met.fresh & ~met.target
        part = self._up_to_another(on, met, passing)
        let, stops = self._pass(now, part, met, passing)
        whole = part.length == on.length
        through, light = now.through * let.value, now.light.spoil(let.spoilt)

        # Light at the end of a shadow ray that has come so far
        end = ~(met.hit.valid & (dr.max(through) > 0)) | met.target | self.lamps.single
        for stop in stops:
            end = end | (stop.active & (now.turn == 0))
        arrives = end & ~met.target & on.active & on.open
        light = light.add(dr.select(arrives, through * on.weight, 0), self._source(on))

        # Go on behind the lamp, or with the next segment
        return Progress(
            turn=now.turn + dr.select(end, mi.UInt32(1), mi.UInt32(0)),
            start=dr.select(end, 0, _beyond(on, met.point, met.distance, met.place)),
            last=dr.select(end, mi.UInt32(NONE), met.hit.lamp),
            passed=dr.select(end, mi.UInt64(0), now.passed | dr.select(whole, met.place.bit, 0)),
            shone=dr.select(end, mi.UInt64(0), now.shone | met.place.bit),
            within=dr.select(self._ends_within(now, on, met), met.hit.lamp, now.within),
            through=dr.select(end, 1, through),
            light=light,
            survived=dr.select(end & (now.turn == 0), through, now.survived),
            question=now.question,
            stops=stops,
        )

    def _pass(
        self, now: Progress, on: Segment, met: Meeting, active: mi.Bool
    ) -> tuple[Answer, list[Stop]]:
        """What a lamp makes of a segment: what is left of it, and whether it ends there."""
        if not self.lamps.finished:
            return self._transmittance(on, now.start, met, active), now.stops
        outgoing = -met.place.direction_to_local(on.direction)
        look = self.lamps.exits.look(met.hit, outgoing)
        cosine = self.lamps.exits.cosine(met.hit, met.place, on.direction)
        # A sheet met from the hollow behind it: nothing else of the lamp is on the way
        behind = dr.dot(met.hit.normal, outgoing) < 0
        hollow = look.sheet & (met.hit.lamp == on.own) & behind
        known = self._transmittance(on, now.start, met, active & ~look.opaque & ~hollow)
        passing = dr.select(hollow, 1 - look.reflectance(cosine), known.value)
        viewing = active & look.known & (now.turn == 0)
        far = self._far_wall(on, met, viewing & look.sheet & ~hollow) if now.stops else None
        parts = Parts.of(look, cosine, passing, far and far.reflectance)
        straight = dr.select(active, parts.straight, 1)
        if not now.stops:
            return Answer(straight, known.spoilt), []
        (before,) = now.stops
        event = parts.draw(before.u, far and far.reflectance)
        ended = viewing & event.stops
        found = self.lamps.exits.vertex(met.hit, met.distance, event.ahead, event.back)
        if far is not None:
            found = dr.select(event.inside, self.lamps.exits.vertex(far.hit, far.distance), found)
        stop = Stop(
            dr.select(ended, found, before.found), before.active | ended,
            dr.select(viewing, event.u, before.u),
        )  # fmt: skip
        return Answer(dr.select(viewing, event.weight, straight), known.spoilt), [stop]

    def _far_wall(self, on: Segment, met: Meeting, active: mi.Bool) -> FarWall | None:
        """The sheet that is met from behind next, in scenes where there are sheets."""
        if not self.lamps.sheets:
            return None
        lift = (1 + met.distance + dr.max(dr.abs(met.point))) * mi.math.RayEpsilon
        start = met.distance + lift
        ray = mi.Ray3f(dr.fma(on.direction, start, on.origin), on.direction)
        ray.maxt = on.length - start
        hit = self.lamps.intersect(ray, active)
        outgoing = -met.place.direction_to_local(on.direction)
        look = self.lamps.exits.look(hit, outgoing)
        cosine = self.lamps.exits.cosine(hit, met.place, on.direction)
        behind = dr.dot(hit.normal, outgoing) < 0
        mirrors = hit.valid & (hit.lamp == met.hit.lamp) & look.sheet & behind
        return FarWall(hit, start + hit.t, dr.select(mirrors, look.reflectance(cosine), 0))

    def _meet(self, now: Progress, on: Segment) -> Meeting:
        """The next lamp on a segment, from where it has been walked to."""
        ray = mi.Ray3f(dr.fma(on.direction, now.start, on.origin), on.direction)
        ray.maxt = on.length - now.start
        hit = self.lamps.intersect(ray, on.active)
        place = self.lamps.place(hit.lamp, hit.valid)
        group = self.lamps.group(hit.lamp, hit.valid)
        fresh = hit.valid & (hit.lamp != now.last) & ((now.passed & place.bit) == 0)
        fresh = fresh & (hit.lamp != on.skip)
        unseen = (hit.lamp != on.shone) & ((now.shone & place.bit) == 0)
        target = fresh & (hit.lamp == on.lamp)
        distance = now.start + hit.t
        point = dr.fma(on.direction, distance, on.origin)
        seen = target & ((on.facet == ANY) | (on.facet == hit.facet))
        return Meeting(hit, place, group, distance, point, fresh, unseen, target, seen)

    def _ends_within(self, now: Progress, on: Segment, met: Meeting) -> mi.Bool:
        """Whether the first segment ends in the sphere of a lamp that it has met."""
        end = dr.fma(on.direction, on.length, on.origin)
        finite = on.length < dr.largest(mi.Float)
        return met.fresh & (now.turn == 0) & finite & (met.place.radii(end) < 1)

    def _up_to_another(self, on: Segment, met: Meeting, active: mi.Bool) -> Segment:
        """The segment up to the next other lamp in the sphere of one that is met, if there is one.

        Between them may be more of the lamp that is met.
        """
        if not self.lamps.overlapping:
            return on
        start = met.distance
        ray = mi.Ray3f(dr.fma(on.direction, start, on.origin), on.direction)
        ray.maxt = on.length - start
        seeking = active & (met.place.bit != 0)
        other = self.lamps.first(ray, met.hit.lamp, seeking, other=True)
        found = start + other.t
        inside = met.place.radii(dr.fma(on.direction, found, on.origin)) < 1
        return replace(on, length=dr.select(other.valid & inside, found, on.length))

    def _shine(self, departure: Departure, now: Progress, on: Segment, met: Meeting) -> Progress:
        """Adds the radiance of a lamp that a view meets, or to which a shadow ray leads."""
        viewing = now.turn == 0
        shining = (met.fresh & met.unseen & viewing) | met.seen
        shining = shining & (met.hit.lamp != on.own)
        part = self._aimed.part_of_finding(on, met, departure, shining & viewing)
        shining = shining & (part.value > 0)
        ray = ExitRay.of(met.place, met.hit, met.point, on.direction)
        radiance = self._queries.radiance(met.place, ray, shining)
        value = now.through * on.weight * radiance.value * part.value
        light = now.light.add(dr.select(shining, value, 0), met.group)
        return replace(now, light=light.spoil(radiance.spoilt + part.spoilt))

    @staticmethod
    def _ask(now: Progress, on: Segment, met: Meeting) -> Progress:
        """Notes the question of the radiance of a lamp to which a shadow ray leads."""
        place, worth = met.place, now.through * on.weight * met.place.dimmer
        ray = ExitRay.of(place, met.hit, met.point, on.direction)
        asked = Question(ray, worth, place.asset, met.group, met.seen)
        return replace(now, question=dr.select(met.seen, asked, now.question))

    def _source(self, on: Segment) -> mi.UInt32:
        """The light group of a shadow ray's end."""
        lamp = on.lamp != NONE
        return dr.select(lamp, self.lamps.group(on.lamp, lamp), OTHERS)


class NoLamps:
    """The walk of a room without lamps: all light arrives.

    Arguments:
        groups: How many light groups are kept apart.
    """

    def __init__(self, groups: int) -> None:
        self._groups = groups

    def __call__(
        self, view: Segment, departure: Departure, shadow_rays: Sequence[Segment],
        sampler: mi.Sampler,
    ) -> Progress:  # fmt: skip
        end = Progress.begin(self._groups, [])
        for ray in shadow_rays:
            end.light = end.light.add(dr.select(ray.active, ray.weight, 0))
        return end


def _choose(segments: Sequence[Segment], turn: mi.UInt32) -> Segment:
    chosen = segments[0]
    for index, segment in enumerate(segments[1:], 1):
        chosen = dr.select(turn == index, segment, chosen)
    return chosen


def _beyond(on: Segment, p: mi.Point3f, distance: mi.Float, place: Place) -> mi.Float:
    """Where a segment goes on after a hit: behind the whole lamp if it overlaps no other."""
    offset = mi.Vector3f(place.centre - on.origin)
    along = dr.dot(offset, on.direction)
    off_axis = dr.squared_norm(dr.fma(on.direction, -along, offset))
    far = along + dr.safe_sqrt(dr.square(place.radius) - off_axis)
    onward = dr.select(place.bit == 0, dr.maximum(far, distance), distance)
    return onward + (1 + onward + dr.max(dr.abs(p))) * mi.math.RayEpsilon
