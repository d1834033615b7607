"""Rays among the lamps: what they emit and let through, up to the first surface of the room."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.table import Hit, Lamps, Place
from purelight_mitsuba.sampling.surface_sampler import share
from purelight_mitsuba.transport.light import OTHERS, Light
from purelight_mitsuba.transport.queries import Queries, surface

CUT = 0.1
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
    """

    origin: mi.Point3f
    direction: mi.Vector3f
    length: mi.Float
    weight: mi.Color3f
    lamp: mi.UInt32
    facet: mi.UInt32
    open: mi.Bool
    active: mi.Bool

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
    ) -> Segment:
        return Segment(
            ray.o, ray.d, length, weight, mi.UInt32(lamp), mi.UInt32(facet), mi.Bool(open),
            mi.Bool(active),
        )  # fmt: skip

    @staticmethod
    def none() -> Segment:
        """A segment that is never walked."""
        zero = mi.Color3f(0)
        return Segment.of(dr.zeros(mi.Ray3f), mi.Float(0), zero, mi.Bool(False))


@dataclass
class Vertex:
    """How a view segment was sampled.

    Arguments:
        point: Where it begins.
        pdf: Density of the direction per solid angle.
        delta: Whether no other technique could have found the direction.
    """

    point: mi.Point3f
    pdf: mi.Float
    delta: mi.Bool


@dataclass
class Question:
    """A point of an exit surface whose radiance is to be known, in the luminaire frame.

    Arguments:
        weight: What the radiance is worth to the pixel.
        asset: Index of the luminaire.
        group: Light group of the lamp.
    """

    position: mi.Point3f
    normal: mi.Normal3f
    outgoing: mi.Vector3f
    weight: mi.Color3f
    asset: mi.UInt32
    group: mi.UInt32
    asked: mi.Bool


@dataclass
class Progress:
    """How far the segments of a lane have been walked."""

    turn: mi.UInt32
    start: mi.Float
    last: mi.UInt32
    passed: mi.UInt64
    through: mi.Color3f
    survived: mi.Color3f
    light: Light
    spoilt: mi.UInt32
    question: Question

    @staticmethod
    def begin(groups: int) -> Progress:
        return Progress(
            mi.UInt32(0), mi.Float(0), mi.UInt32(NONE), mi.UInt64(0), mi.Color3f(1), mi.Color3f(1),
            Light.dark(groups), mi.UInt32(0), dr.zeros(Question),
        )  # fmt: skip


class Walk:
    """Walks segments through the lamps, all kinds in one loop: networks are traced only once."""

    def __init__(self, lamps: Lamps, queries: Queries) -> None:
        self._lamps, self._queries = lamps, queries

    def __call__(
        self,
        view: Segment,
        vertex: Vertex,
        stock: Sequence[Segment],
        aimed: Sequence[Segment],
    ) -> tuple[Light, mi.Color3f, mi.UInt32]:
        """Follows a path's own segment and the shadow rays of its last vertex.

        Arguments:
            view: Up to the room's next surface; sees every lamp on the way.
            stock: Shadow rays to emitters of Mitsuba's.
            aimed: Shadow rays to lamps.

        Returns:
            Light for the pixel, transmittance of the view segment, and how many answers of
            networks were spoilt.
        """
        end = self._follow([view, *stock, *aimed], vertex)
        return end.light, end.survived, end.spoilt

    def ask(self, aimed: Segment) -> tuple[Light, Question, mi.UInt32]:
        """Follows a shadow ray to a lamp without evaluating the lamp's radiance.

        Returns:
            Light that is known already, what is left to ask, and how many answers of networks were
            spoilt.
        """
        end = self._follow([aimed], None)
        return end.light, end.question, end.spoilt

    def _follow(self, segments: Sequence[Segment], vertex: Vertex | None) -> Progress:
        def body(now: Progress) -> tuple[Progress]:
            return (self._step(now, _choose(segments, now.turn), vertex),)

        (end,) = dr.while_loop(
            (Progress.begin(len(self._lamps.groups)),),
            lambda now: now.turn < len(segments),
            body,
            label="walk among the lamps",
        )
        return end

    def _step(self, now: Progress, on: Segment, vertex: Vertex | None) -> Progress:
        """Meets the next lamp of a segment or ends it; without a vertex, none is a view."""
        viewing = now.turn == 0 if vertex is not None else mi.Bool(False)
        ray = mi.Ray3f(dr.fma(on.direction, now.start, on.origin), on.direction)
        ray.maxt = on.length - now.start
        hit = self._lamps.intersect(ray, on.active)
        place = self._lamps.place(hit.lamp, hit.valid)
        fresh = hit.valid & (hit.lamp != now.last) & ((now.passed & place.bit) == 0)
        target = fresh & (hit.lamp == on.lamp)
        distance = now.start + hit.t
        p = dr.fma(on.direction, distance, on.origin)
        seen = target & ((on.facet == ANY) | (on.facet == hit.facet))

        arriving = now.through * on.weight
        group = self._lamps.group(hit.lamp, hit.valid)
        light = now.light.add(dr.select(target & (on.facet == NONE), arriving, 0), group)
        question, spoilt = now.question, mi.UInt32(0)
        if vertex is None:
            asked = Question(
                *surface(place, hit, p, on.direction), arriving * place.dimmer, place.asset, group,
                seen,
            )  # fmt: skip
            question = dr.select(seen, asked, question)
        else:
            shining = (fresh & viewing) | seen
            part, spoilt_pdf = self._part(on, distance, place, hit, vertex, shining & viewing)
            shining = shining & (part > 0)
            radiance, spoilt = self._queries.radiance(place, hit, p, on.direction, shining)
            light = light.add(dr.select(shining, arriving * radiance * part, 0), group)
            spoilt = spoilt + spoilt_pdf
        passing = fresh & ~target
        met, at, along = self._seen_from(on, now.start, place, hit, p, passing)
        blocking, spoilt_through = self._queries.transmittance(place, met, at, along, passing)
        through = now.through * blocking

        end = ~(hit.valid & (dr.max(through) > 0)) | target | self._lamps.single
        arrives = end & ~target & on.active & on.open
        light = light.add(dr.select(arrives, through * on.weight, 0), self._source(on))
        return Progress(
            turn=now.turn + dr.select(end, mi.UInt32(1), mi.UInt32(0)),
            start=dr.select(end, 0, _beyond(on, p, distance, place)),
            last=dr.select(end, mi.UInt32(NONE), hit.lamp),
            passed=dr.select(end, mi.UInt64(0), now.passed | place.bit),
            through=dr.select(end, 1, through),
            survived=dr.select(end & viewing, through, now.survived),
            light=light,
            spoilt=now.spoilt + spoilt + spoilt_through,
            question=question,
        )

    def _seen_from(
        self, on: Segment, start: mi.Float, place: Place, hit: Hit, p: mi.Point3f, active: mi.Bool
    ) -> tuple[Hit, mi.Point3f, mi.Vector3f]:
        """From where a lamp's transmittance is that of the segment: hit, its point, and direction.

        It is that of the whole lamp ahead of who asks. If the segment ends at something between the
        lamp's parts, so that some are beyond, it is asked from there, back along the segment;
        unless that has some behind it too, and then neither end knows the part between.
        """
        end = dr.fma(on.direction, on.length, on.origin)
        between = active & (on.length < dr.largest(mi.Float)) & (place.radii(end) < 1)

        def choose(
            on: Segment, start: mi.Float, hit: Hit, p: mi.Point3f, end: mi.Point3f
        ) -> tuple[Hit, mi.Point3f, mi.Vector3f]:
            begin = dr.fma(on.direction, start, on.origin)
            beyond = self._meets(end, on.direction, hit.lamp)
            behind = self._meets(begin, -on.direction, hit.lamp)
            back = self._lamps.intersect(mi.Ray3f(end, -on.direction), beyond & ~behind)
            turned = beyond & ~behind & back.valid & (back.lamp == hit.lamp)
            at = dr.fma(-on.direction, back.t, end)
            along = dr.select(turned, -on.direction, on.direction)
            return dr.select(turned, back, hit), dr.select(turned, at, p), along

        return dr.if_stmt(
            (on, start, hit, p, end),
            between,
            choose,
            lambda on, start, hit, p, end: (hit, p, on.direction),
        )

    def _meets(self, origin: mi.Point3f, direction: mi.Vector3f, lamp: mi.UInt32) -> mi.Bool:
        """Whether a ray's first lamp is this one."""
        found = self._lamps.intersect(mi.Ray3f(origin, direction), mi.Bool(True))
        return found.valid & (found.lamp == lamp)

    def _source(self, on: Segment) -> mi.UInt32:
        """The light group of a shadow ray's end."""
        lamp = on.lamp != NONE
        return dr.select(lamp, self._lamps.group(on.lamp, lamp), OTHERS)

    def _part(
        self,
        on: Segment,
        distance: mi.Float,
        place: Place,
        hit: Hit,
        vertex: Vertex,
        active: mi.Bool,
    ) -> tuple[mi.Float, mi.UInt32]:
        """The weight of finding a lamp by the BSDF, against aiming at it."""
        if self._lamps.dark:
            return mi.Float(1), mi.UInt32(0)
        compete = active & ~vertex.delta
        near = share(place.radii(vertex.point))
        pdf, spoilt = self._queries.pdf_solid_angle(
            place, on.origin, on.direction, compete & (near < 1)
        )
        (pdf_surface,) = dr.if_stmt(
            (place, hit, on.direction * (distance / place.scale)),
            compete & (near > 0),
            lambda *arguments: (self._pdf_surface(*arguments),),
            lambda *_: (mi.Float(0),),
        )
        chance = self._lamps.probability(hit.lamp, vertex.point, compete)
        heuristic = cutoff if self._queries.fast else power
        part = dr.lerp(
            heuristic(vertex.pdf, pdf * chance), power(vertex.pdf, pdf_surface * chance), near
        )
        return dr.select(compete, part, 1), spoilt

    def _pdf_surface(self, place: Place, hit: Hit, toward: mi.Vector3f) -> mi.Float:
        """The density of the surface sampler for where a lamp was met."""
        facet = hit.facet - self._lamps.first_facet(hit.lamp)
        local = place.direction_to_local(toward)
        return self._lamps.surface.pdf_solid_angle(
            place.asset, facet, hit.normal, local, mi.Bool(True)
        )


def power(a: mi.Float, b: mi.Float) -> mi.Float:
    """Veach's power heuristic, free of overflow; zero where a is."""
    ratio = dr.select(a > 0, b / a, dr.inf)
    return 1 / (1 + dr.square(ratio))


def cutoff(a: mi.Float, b: mi.Float) -> mi.Float:
    """Veach's cutoff heuristic: as `power`, but a tenth of the other density is worth nothing."""
    return dr.select(a < CUT * b, 0, dr.select(b < CUT * a, 1, power(a, b)))


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
