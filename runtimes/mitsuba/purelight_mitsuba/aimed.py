"""The shadow ray that a vertex aims at one of the lamps."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.cap import INSIDE
from purelight_mitsuba.lamps import Lamps, Place
from purelight_mitsuba.queries import Queries
from purelight_mitsuba.walk import Segment, power


class AimedLamps:
    """Next-event estimation of the lamps.

    Each vertex picks one lamp by its power. Its direction comes from the sampler, and its light is
    the appearance network's where the ray meets the lamp; in fast mode the radiance map gives both.

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
        sampler: mi.Sampler,
        active: mi.Bool,
    ) -> list[Segment]:
        """Sends a shadow ray toward a lamp; points inside its bounding sphere send none."""
        if self._lamps.dark:
            return []
        lamp, chance = self._lamps.pick(sampler.next_1d(), active)
        place = self._lamps.place(lamp, active)
        active = active & (dr.norm(place.centre - si.p) > place.radius * INSIDE)
        toward, pdf, weight, spoilt = self._queries.aim(place, si.p, sampler.next_2d(), active)
        path.spoilt = path.spoilt + spoilt
        value, pdf_bsdf = bsdf.eval_pdf(mi.BSDFContext(), si, si.to_local(toward), active)
        total = path.throughput * value * weight * (power(pdf * chance, pdf_bsdf) / chance)
        # Toward the same point of the lamp, although the ray starts a little off the surface.
        ray = si.spawn_ray_to(si.p + toward * dr.dot(place.centre - si.p, toward))
        useful = active & (pdf > 0) & (dr.max(total) > 0)
        length, free = self._reach(scene, place, ray, useful)
        return [Segment.of(ray, length, total, free, lamp)]

    def _reach(
        self, scene: mi.Scene, place: Place, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Float, mi.Bool]:
        """How far a shadow ray goes in the room, and whether that may reach the lamp."""
        along = dr.dot(place.centre - ray.o, ray.d)
        off_axis = dr.squared_norm(dr.fma(ray.d, -along, place.centre - ray.o))
        half = dr.safe_sqrt(dr.square(place.radius) - off_axis)
        limited = mi.Ray3f(ray)
        if self._queries.fast:
            limited.maxt = along - half
            return limited.maxt, active & ~scene.ray_test(limited, active)
        limited.maxt = (along + half) * (1 + mi.math.RayEpsilon)
        found = scene.ray_intersect_preliminary(limited, active=active)
        return dr.select(found.is_valid(), found.t, limited.maxt), active
