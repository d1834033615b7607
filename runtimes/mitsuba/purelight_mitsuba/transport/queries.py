"""What a path asks the networks, lane by lane, whichever lamp each lane has met."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.lamps.table import Hit, Lamps, Place
from purelight_mitsuba.sampling.cap import Cap, cap
from purelight_mitsuba.sampling.radiance_map import Drawn, draw, lit
from purelight_mitsuba.transport.batched_maps import compiled, draw_batched

# Against the BSDF's density, a radiance map counts for so many times the uniform one of the cap,
# since bright parts of a lamp are drawn more often than evenly, and near a lamp, where that is low,
# for this density in 1/sr: only lobes narrower than about a third of a radian are worth the
# appearance network. Either only moves light between the map and that network. The map's own
# density would cost a whole map for every hit.
FAVOUR, MATT = 4.0, 8.0

Answer = tuple[Any, Any, Any, Any]  # Direction, density, weight, spoilt answers.


class Queries:
    """The networks of all lamps; each is evaluated only by packets with a lane that needs it.

    No answer is ever infinite or NaN: such outputs count as zero, and are counted.

    Arguments:
        lamps: The lamps of the scene.
        fast: Whether the lamps light the room by their radiance maps.
        queued: Whether `aim` is only called outside of symbolic loops.
    """

    def __init__(self, lamps: Lamps, *, fast: bool, queued: bool = False) -> None:
        self._luminaires = lamps.luminaires
        self.fast = fast
        self._batched = [
            fast and queued and not compiled(luminaire) for luminaire in self._luminaires
        ]
        for luminaire, batched in zip(self._luminaires, self._batched, strict=True):
            for name in self._names(luminaire, batched):
                luminaire.network(name)

    def _names(self, luminaire: Luminaire, batched: bool) -> list[str]:
        """The networks that are translated, so that they are on the device before tracing."""
        names = ["appearance"] + ["transparency"] * luminaire.has("transparency")
        if self.fast:
            return names + ["fast_map"] * (not batched)
        return names + ["sampler", "sampler_pdf"] * _learned(luminaire)

    def radiance(
        self, place: Place, hit: Hit, p: mi.Point3f, d: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Color3f, mi.UInt32]:
        """Radiance from an exit surface along -d, W/(m² sr), and how many answers were spoilt."""

        def network(luminaire: Luminaire, *there: Any) -> tuple[mi.Color3f, mi.UInt32]:
            return finite(mi.Color3f(*luminaire.network("appearance")(*there)[0]))

        zero = (mi.Color3f(0), mi.UInt32(0))
        there = surface(place, hit, p, d)
        radiance, spoilt = self._each(place.asset, active, network, there, zero)
        return radiance * place.dimmer, spoilt

    def transmittance(
        self, place: Place, hit: Hit, p: mi.Point3f, d: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Color3f, mi.UInt32]:
        """Transmittance of the whole line through a lamp, one where inactive."""

        def network(luminaire: Luminaire, *there: Any) -> tuple[mi.Color3f, mi.UInt32]:
            if not luminaire.has("transparency"):
                return mi.Color3f(0), mi.UInt32(0)
            return finite(mi.Color3f(*luminaire.network("transparency")(*there)[0]))

        one = (mi.Color3f(1), mi.UInt32(0))
        return self._each(place.asset, active, network, surface(place, hit, p, d), one)

    def pdf_solid_angle(
        self, place: Place, p: mi.Point3f, d: mi.Vector3f, active: mi.Bool
    ) -> tuple[mi.Float, mi.UInt32]:
        """The density by which a lamp's directions are weighed against the BSDF's.

        It is the sampler's own; in fast mode what a map counts for (`FAVOUR`).
        """

        def network(luminaire: Luminaire, point: Any, toward: Any) -> tuple[mi.Float, mi.UInt32]:
            if self.fast or not _learned(luminaire):
                pdf = _cap(luminaire, point).pdf_solid_angle()
                return _favoured(pdf) if self.fast else pdf, mi.UInt32(0)
            (pdf,) = luminaire.network("sampler_pdf")(point, toward)
            return finite(pdf.item())

        local = (place.point_to_local(p), place.direction_to_local(d))
        return self._each(place.asset, active, network, local, (mi.Float(0), mi.UInt32(0)))

    def aim(
        self, place: Place, p: mi.Point3f, u: mi.Point2f, active: mi.Bool
    ) -> tuple[mi.Vector3f, mi.Float, mi.Color3f, mi.UInt32]:
        """Draws a direction toward a lamp.

        Returns:
            The direction in the world, the density of `pdf_solid_angle` there, what to multiply
            the lamp's radiance by (in fast mode the product itself), and how many answers were
            spoilt.
        """
        function = self._from_map if self.fast else self._from_sampler
        zero = (mi.Vector3f(0, 0, 1), mi.Float(0), mi.Color3f(0), mi.UInt32(0))
        point = place.point_to_local(p)
        drawn = [self._drawn(place.asset, point, u, active)] if self.fast else []
        local = (point, u, *drawn)
        toward, pdf, weight, spoilt = self._each(place.asset, active, function, local, zero)
        dimmer = place.dimmer if self.fast else 1
        return place.direction_to_world(toward), pdf, weight * dimmer, spoilt

    @staticmethod
    def _from_sampler(luminaire: Luminaire, point: mi.Point3f, u: mi.Point2f) -> Answer:
        if not _learned(luminaire):
            view = _cap(luminaire, point)
            toward, pdf, spoilt = view.direction(u), view.pdf_solid_angle(), mi.UInt32(0)
        else:
            columns, density = luminaire.network("sampler")(point, u)
            toward, spoilt = finite(mi.Vector3f(*columns))
            pdf, spoilt_pdf = finite(density.item())
            pdf = dr.select(spoilt > 0, 0, pdf)
            spoilt = spoilt | spoilt_pdf
        return toward, pdf, mi.Color3f(dr.select(pdf > 0, 1 / pdf, 0)), spoilt

    def _drawn(self, asset: mi.UInt32, point: mi.Point3f, u: mi.Point2f, active: mi.Bool) -> Drawn:
        """What is drawn from the maps of ONNX Runtime."""
        result = dr.zeros(Drawn)
        for index, luminaire in enumerate(self._luminaires):
            if self._batched[index]:
                own = active & (asset == index)
                result = dr.select(own, draw_batched(luminaire, point, u, own), result)
        return result

    def _from_map(
        self, luminaire: Luminaire, point: mi.Point3f, u: mi.Point2f, drawn: Drawn
    ) -> Answer:
        if not self._batched[self._luminaires.index(luminaire)]:
            (cells,) = luminaire.network("fast_map")(point)
            drawn = draw(lit(cells, luminaire.flux), u)
        view = _cap(luminaire, point)
        pdf = view.pdf_solid_angle()
        weight, spoilt = finite(dr.select(view.outside, drawn.weight / pdf, 0))
        return view.direction(drawn.square), _favoured(pdf), weight, spoilt | drawn.spoilt

    def _each(
        self,
        asset: mi.UInt32,
        active: mi.Bool,
        function: Callable[..., tuple[Any, ...]],
        arguments: Sequence[Any],
        default: tuple[Any, ...],
    ) -> tuple[Any, ...]:
        """Calls a function for the lanes of each luminaire in turn."""
        result = default
        for index, luminaire in enumerate(self._luminaires):
            result = dr.if_stmt(
                (result, *arguments),
                active & (asset == index),
                lambda _, *values, luminaire=luminaire: function(luminaire, *values),
                lambda before, *_: before,
            )
        return result


def _learned(luminaire: Luminaire) -> bool:
    """Whether directions are drawn by a network; it is no use without its density."""
    return luminaire.has("sampler") and luminaire.has("sampler_pdf")


def _favoured(pdf: mi.Float) -> mi.Float:
    """What a map counts for against BSDFs, from the uniform density of the cap, zero inside."""
    return dr.select(pdf > 0, dr.maximum(pdf * FAVOUR, MATT), 0)


def _cap(luminaire: Luminaire, point: mi.Point3f) -> Cap:
    sphere = luminaire.sphere
    return cap(point, mi.Point3f(*sphere.center), mi.Float(sphere.radius))


def surface(
    place: Place, hit: Hit, p: mi.Point3f, d: mi.Vector3f
) -> tuple[mi.Point3f, mi.Normal3f, mi.Vector3f]:
    """Position, normal on the side of outgoing, and outgoing, in the luminaire frame."""
    outgoing = -place.direction_to_local(d)
    facing = dr.dot(hit.normal, outgoing) >= 0
    return place.point_to_local(p), dr.select(facing, hit.normal, -hit.normal), outgoing


def finite(value: Any) -> tuple[Any, mi.UInt32]:
    """Replaces answers that are infinite or NaN by zero; 1 where there was one."""
    finite = dr.isfinite(value)
    good = dr.all(finite) if dr.depth_v(value) > 1 else finite
    return dr.select(good, value, 0), dr.select(good, mi.UInt32(0), mi.UInt32(1))
