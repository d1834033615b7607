"""The shadow ray that a vertex aims at one of the lamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.table import Lamps, Place
from purelight_mitsuba.sampling.surface_sampler import share
from purelight_mitsuba.transport.queries import Queries
from purelight_mitsuba.transport.walk import ANY, NONE, Segment, cutoff, power


@dataclass
class Aim:
    """Where shadow rays lead.

    Arguments:
        target: A point on them.
        toward: Unit direction to it.
        pdf: What counts as its density per solid angle, against the BSDF's.
        weight: What to multiply the lamp's radiance by, or the product if `facet` is NONE.
        facet: As in `Segment`.
        spoilt: How many answers of networks were spoilt.
    """

    target: mi.Point3f
    toward: mi.Vector3f
    pdf: mi.Float
    weight: mi.Color3f
    facet: mi.UInt32
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
        lamps: The lamps of the scene, not all dark.
        queries: Their networks.
    """

    def __init__(self, lamps: Lamps, queries: Queries) -> None:
        self._lamps, self._queries = lamps, queries

    def none(self) -> list[Segment]:
        """As many shadow rays as `aim` returns, none of them active."""
        return [] if self._lamps.dark else [Segment.none()]

    def aim(
        self,
        scene: mi.Scene,
        si: mi.SurfaceInteraction3f,
        bsdf: mi.BSDFPtr,
        path: Any,
        numbers: Numbers,
        active: mi.Bool,
    ) -> list[Segment]:
        """Sends a shadow ray toward a lamp."""
        if self._lamps.dark:
            return []
        lamp, chance = self._lamps.pick(numbers.lamp, si.p, active)
        place = self._lamps.place(lamp, active)
        near = active & (numbers.near < share(place.radii(si.p)))
        choice, u = numbers.choice, numbers.u
        aim = self._by_network(place, si, u, active & ~near)
        start = mi.Interaction3f(si.t, si.time, si.wavelengths, si.p, si.n)
        aim = dr.if_stmt(  # Packets of lanes that are all far away skip it.
            (aim, lamp, place, start, choice, u),
            near,
            lambda _, *arguments: self._by_surface(*arguments),
            lambda before, *_: before,
        )
        path.spoilt = path.spoilt + aim.spoilt
        value, pdf_bsdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(aim.toward), active)
        density = aim.pdf * chance
        part = power(density, pdf_bsdf)
        if self._queries.fast:
            part = dr.select(aim.facet == NONE, cutoff(density, pdf_bsdf), part)
        total = path.throughput * value * aim.weight * (part / chance)
        # Toward the same point of the lamp, although the ray starts a little off the surface.
        ray = si.spawn_ray_to(aim.target)
        useful = active & (aim.pdf > 0) & (dr.max(total) > 0)
        length, open = self._reach(scene, place, ray, useful)
        known = aim.facet == NONE
        return [
            Segment.of(ray, length, total, useful, lamp=lamp, facet=aim.facet, open=known & open)
        ]

    def _by_network(
        self, place: Place, si: mi.SurfaceInteraction3f, u: mi.Point2f, active: mi.Bool
    ) -> Aim:
        """A direction of the sampler's, or of the radiance map's."""
        toward, pdf, weight, spoilt = self._queries.aim(place, si.p, u, active)
        target = mi.Point3f(si.p + toward * dr.dot(place.centre - si.p, toward))
        facet = mi.UInt32(NONE if self._queries.fast else ANY)
        return Aim(target, toward, pdf, weight, facet, spoilt)

    def _by_surface(
        self,
        lamp: mi.UInt32,
        place: Place,
        start: mi.Interaction3f,
        choice: mi.Point2f,
        u: mi.Point2f,
    ) -> Aim:
        """A point of the exit surface; its light counts if the ray meets its triangle first."""
        drawn = self._lamps.surface.sample(place.asset, choice, u, mi.Bool(True))
        target = place.point_to_world(drawn.position)
        ray = start.spawn_ray_to(target)
        offset = place.direction_to_local(mi.Vector3f(target - ray.o) / place.scale)
        pdf = self._lamps.surface.pdf_solid_angle(
            place.asset, drawn.facet, drawn.normal, offset, mi.Bool(True)
        )
        weight = mi.Color3f(dr.select(pdf > 0, 1 / pdf, 0))
        facet = self._lamps.first_facet(lamp) + drawn.facet
        return Aim(target, ray.d, pdf, weight, facet, mi.UInt32(0))

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
