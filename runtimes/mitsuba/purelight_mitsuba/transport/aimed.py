"""Next-event estimation of the lamps: the shadow ray that a vertex aims at one of them."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Lamps, Place
from purelight_mitsuba.sampling.surface_sampler import share
from purelight_mitsuba.transport.mis import cutoff, power
from purelight_mitsuba.transport.queries import Answer, Direction, Queries
from purelight_mitsuba.transport.segment import ANY, NONE, Meeting, Segment
from purelight_mitsuba.transport.state import Departure, Vertex


@dataclass
class Aim(Direction):
    """Where shadow rays lead.

    Arguments:
        target: A point on them.
        facet: As in `Segment`; if it is NONE, `weight` includes the lamp's radiance.
    """

    target: mi.Point3f
    facet: mi.UInt32


@dataclass
class Shot:
    """Shadow rays that were sent.

    Arguments:
        segments: One, or none if all lamps are dark.
        spoilt: How many answers of networks were spoilt on the way.
    """

    segments: list[Segment]
    spoilt: mi.UInt32


@dataclass
class Numbers:
    """Uniform numbers that aim one shadow ray: which lamp, which way, triangle, and direction."""

    lamp: mi.Float
    near: mi.Float
    choice: mi.Point2f
    u: mi.Point2f

    @staticmethod
    def draw(sampler: mi.Sampler) -> Numbers:
        """Takes the next numbers of a sampler."""
        return Numbers(sampler.next_1d(), sampler.next_1d(), sampler.next_2d(), sampler.next_2d())


class AimedLamps:
    """Next-event estimation of the lamps.

    Each vertex picks one lamp by what it could give there (`lamp_choice`). Its direction comes from
    the sampler, and its light is the appearance network's where the ray meets the lamp; in fast
    mode the radiance map gives both. Inside the bounding sphere, and sometimes shortly outside, a
    point of the exit surface gives the direction instead: `share` of the vertices at one place do
    so, and light that the BSDF finds is weighed against both ways in the same proportion.

    Arguments:
        lamps: The lamps of the scene.
        queries: Their networks.
    """

    def __init__(self, lamps: Lamps, queries: Queries) -> None:
        self.lamps, self._queries = lamps, queries

    def none(self) -> list[Segment]:
        """As many shadow rays as `aim` returns, none of them active."""
        return [] if self.lamps.dark else [Segment.none()]

    def aim(
        self, scene: mi.Scene, vertex: Vertex, throughput: mi.Color3f, numbers: Numbers,
        active: mi.Bool,
    ) -> Shot:  # fmt: skip
        """Sends a shadow ray toward a lamp.

        Arguments:
            throughput: Of the path up to the vertex.
        """
        if self.lamps.dark:
            return Shot([], mi.UInt32(0))
        # Choose a lamp and a direction toward it
        si = vertex.si
        lamp, chance = self.lamps.pick(numbers.lamp, si.p, active, vertex.own)
        active = active & (chance > 0)
        place = self.lamps.place(lamp, active)
        aim = self._direction(lamp, place, si, numbers, active)

        # What its light would be worth to the pixel
        wo = si.to_local(aim.toward)
        value, pdf_bsdf = vertex.bsdf.eval_pdf(mi.BSDFContext(), si, wo, active)
        part = self._part_of_aiming(aim, chance, pdf_bsdf)
        total = throughput * value * aim.weight * (part / chance)

        # Toward the same point of the lamp, although the ray starts a little off the surface
        ray = si.spawn_ray_to(aim.target)
        useful = active & (aim.pdf_solid_angle > 0) & (dr.max(total) > 0)
        length, passes = self._reach(scene, place, ray, useful)
        open = (aim.facet == NONE) & passes
        segment = Segment.of(
            ray, length, total, useful, lamp=lamp, facet=aim.facet, open=open,
            own=vertex.own, skip=vertex.skip,
        )  # fmt: skip
        return Shot([segment], aim.spoilt)

    def part_of_finding(
        self, on: Segment, met: Meeting, departure: Departure, active: mi.Bool
    ) -> Answer:
        """The weight of light that a view found by the BSDF, against aiming at it.

        It is one where inactive, or where no other technique could have found it.
        """
        if self.lamps.dark:
            return Answer(mi.Float(1))
        compete, start = active & ~departure.delta, departure.vertex.p
        near = share(met.place.radii(start))
        pdf = self._queries.pdf_solid_angle(
            met.place, on.origin, on.direction, compete & (near < 1)
        )
        (pdf_surface,) = dr.if_stmt(
            (met.place, met.hit, on.direction * (met.distance / met.place.scale)),
            compete & (near > 0),
            lambda *arguments: (self._pdf_surface(*arguments),),
            lambda *_: (mi.Float(0),),
        )
        chance = self.lamps.probability(met.hit.lamp, start, compete, departure.own)
        own, heuristic = departure.pdf_solid_angle, cutoff if self._queries.fast else power
        part = dr.lerp(heuristic(own, pdf.value * chance), power(own, pdf_surface * chance), near)
        return Answer(dr.select(compete, part, 1), pdf.spoilt)

    def _part_of_aiming(self, aim: Aim, chance: mi.Float, pdf_bsdf: mi.Float) -> mi.Float:
        """The weight of light that was aimed at, against finding it by the BSDF."""
        pdf = aim.pdf_solid_angle * chance
        part = power(pdf, pdf_bsdf)
        if not self._queries.fast:
            return part
        return dr.select(aim.facet == NONE, cutoff(pdf, pdf_bsdf), part)

    def _direction(
        self, lamp: mi.UInt32, place: Place, si: mi.SurfaceInteraction3f, numbers: Numbers,
        active: mi.Bool,
    ) -> Aim:  # fmt: skip
        """One of the two ways to aim, `share` of the vertices by a point of the exit surface."""
        near = active & (numbers.near < share(place.radii(si.p)))
        aim = self._by_network(place, si, numbers.u, active & ~near)
        start = mi.Interaction3f(si.t, si.time, si.wavelengths, si.p, si.n)
        return dr.if_stmt(  # Packets of lanes that are all far away skip it.
            (aim, lamp, place, start, numbers.choice, numbers.u),
            near,
            lambda _, *arguments: self._by_surface(*arguments),
            lambda before, *_: before,
        )

    def _by_network(
        self, place: Place, si: mi.SurfaceInteraction3f, u: mi.Point2f, active: mi.Bool
    ) -> Aim:
        """A direction of the sampler's, or of the radiance map's."""
        drawn = self._queries.aim(place, si.p, u, active)
        along = dr.dot(place.centre - si.p, drawn.toward)
        target = mi.Point3f(si.p + drawn.toward * along)
        facet = mi.UInt32(NONE if self._queries.fast else ANY)
        return Aim(**vars(drawn), target=target, facet=facet)

    def _by_surface(
        self, lamp: mi.UInt32, place: Place, start: mi.Interaction3f, choice: mi.Point2f,
        u: mi.Point2f,
    ) -> Aim:  # fmt: skip
        """A point of the exit surface; its light counts if the ray meets its triangle first."""
        drawn = self.lamps.surface.sample(place.asset, choice, u, mi.Bool(True))
        target = place.point_to_world(drawn.position)
        ray = start.spawn_ray_to(target)
        offset = place.direction_to_local(mi.Vector3f(target - ray.o) / place.scale)
        pdf = self.lamps.surface.pdf_solid_angle(
            place.asset, drawn.facet, drawn.normal, offset, mi.Bool(True)
        )
        weight = mi.Color3f(dr.select(pdf > 0, 1 / pdf, 0))
        facet = self.lamps.exits.first_facet(lamp) + drawn.facet
        return Aim(ray.d, pdf, weight, mi.UInt32(0), target, facet)

    def _pdf_surface(self, place: Place, hit: Hit, toward: mi.Vector3f) -> mi.Float:
        """The density of the surface sampler for where a lamp was met."""
        facet = hit.facet - self.lamps.exits.first_facet(hit.lamp)
        local = place.direction_to_local(toward)
        return self.lamps.surface.pdf_solid_angle(
            place.asset, facet, hit.normal, local, mi.Bool(True)
        )

    def _reach(
        self, scene: mi.Scene, place: Place, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Float, mi.Bool]:
        """How far a shadow ray goes in the room, and whether it passes the lamp's centre."""
        along = dr.dot(place.centre - ray.o, ray.d)
        off_axis = dr.squared_norm(dr.fma(ray.d, -along, place.centre - ray.o))
        half = dr.safe_sqrt(dr.square(place.radius) - off_axis)
        limited = mi.Ray3f(ray)
        limited.maxt = (along + half) * (1 + mi.math.RayEpsilon)
        found = scene.ray_intersect_preliminary(limited, active=active)
        length = dr.select(found.is_valid(), found.t, limited.maxt)
        return length, length > along
