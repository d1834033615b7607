"""What a path asks the networks, lane by lane, whichever lamp each lane has met."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.lamps.table import Lamps, Place
from purelight_mitsuba.sampling.cap import Cap, cap
from purelight_mitsuba.sampling.radiance_map import Drawn, draw, lit
from purelight_mitsuba.transport.batched_maps import compiled, draw_batched

# Against the BSDF's density, a radiance map counts for so many times the uniform one of the cap,
# since bright parts of a lamp are drawn more often than evenly, and near a lamp, where that is low,
# for this density in 1/sr: only lobes narrower than about a third of a radian are worth the
# appearance network. Either only moves light between the map and that network. The map's own
# density would cost a whole map for every hit.
FAVOUR, MATT = 4.0, 8.0

Found = TypeVar("Found")


@dataclass
class Answer:
    """What a network says.

    Arguments:
        value: Of one number or three; zero where one was infinite or NaN.
        spoilt: One there, and else zero.
    """

    value: Any
    spoilt: mi.UInt32 = field(default_factory=lambda: mi.UInt32(0))


@dataclass
class Direction:
    """A direction drawn toward a lamp.

    Arguments:
        toward: Unit vector.
        pdf_solid_angle: What counts as its density against the BSDF's: `Queries.pdf_solid_angle`.
        weight: What to multiply the lamp's radiance by; in fast mode the product itself.
        spoilt: How many answers of networks were spoilt.
    """

    toward: mi.Vector3f
    pdf_solid_angle: mi.Float
    weight: mi.Color3f
    spoilt: mi.UInt32


@dataclass
class ExitRay:
    """A ray that leaves an exit surface, in the luminaire frame.

    Arguments:
        normal: Geometric unit normal on the side of `outgoing`.
    """

    position: mi.Point3f
    normal: mi.Normal3f
    outgoing: mi.Vector3f

    @staticmethod
    def of(place: Place, hit: Hit, p: mi.Point3f, d: mi.Vector3f) -> ExitRay:
        """The ray that comes back from p, along -d in the world, where a lamp was hit."""
        outgoing = -place.direction_to_local(d)
        facing = dr.dot(hit.normal, outgoing) >= 0
        normal = dr.select(facing, hit.normal, -hit.normal)
        return ExitRay(place.point_to_local(p), normal, outgoing)

    def ask(self, luminaire: Luminaire, network: str) -> mi.Color3f:
        """What a network of the luminaire says, infinite and NaN included."""
        (value,) = luminaire.network(network)(self.position, self.normal, self.outgoing)
        return mi.Color3f(*value)


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

    def radiance(self, place: Place, ray: ExitRay, active: mi.Bool) -> Answer:
        """Radiance of rays from an exit surface, W/(m² sr)."""
        answer = self._ask("appearance", place, ray, active, Answer(mi.Color3f(0)))
        return Answer(answer.value * place.dimmer, answer.spoilt)

    def transmittance(self, place: Place, ray: ExitRay, active: mi.Bool) -> Answer:
        """Transmittance of the whole line through a lamp, one where inactive."""
        return self._ask("transparency", place, ray, active, Answer(mi.Color3f(1)))

    def _ask(
        self, name: str, place: Place, ray: ExitRay, active: mi.Bool, inactive: Answer
    ) -> Answer:
        """What a network says of rays from an exit surface; zero from lamps without it."""

        def network(luminaire: Luminaire, ray: ExitRay) -> Answer:
            if not luminaire.has(name):
                return Answer(mi.Color3f(0))
            return finite(ray.ask(luminaire, name))

        return self._each(place.asset, active, network, (ray,), inactive)

    def pdf_solid_angle(
        self, place: Place, p: mi.Point3f, d: mi.Vector3f, active: mi.Bool
    ) -> Answer:
        """The density by which a lamp's directions are weighed against the BSDF's.

        It is the sampler's own; in fast mode what a map counts for (`FAVOUR`).
        """

        def network(luminaire: Luminaire, point: mi.Point3f, toward: mi.Vector3f) -> Answer:
            if self.fast or not _learned(luminaire):
                pdf = _cap(luminaire, point).pdf_solid_angle()
                return Answer(_favoured(pdf) if self.fast else pdf)
            (pdf,) = luminaire.network("sampler_pdf")(point, toward)
            return finite(pdf.item())

        local = (place.point_to_local(p), place.direction_to_local(d))
        return self._each(place.asset, active, network, local, Answer(mi.Float(0)))

    def aim(self, place: Place, p: mi.Point3f, u: mi.Point2f, active: mi.Bool) -> Direction:
        """Draws a direction toward a lamp, in the world."""
        function = self._from_map if self.fast else self._from_sampler
        none = Direction(mi.Vector3f(0, 0, 1), mi.Float(0), mi.Color3f(0), mi.UInt32(0))
        point = place.point_to_local(p)
        drawn = [self._drawn(place.asset, point, u, active)] if self.fast else []
        aim = self._each(place.asset, active, function, (point, u, *drawn), none)
        weight = aim.weight * (place.dimmer if self.fast else 1)
        return replace(aim, toward=place.direction_to_world(aim.toward), weight=weight)

    @staticmethod
    def _from_sampler(luminaire: Luminaire, point: mi.Point3f, u: mi.Point2f) -> Direction:
        if not _learned(luminaire):
            view = _cap(luminaire, point)
            toward, pdf, spoilt = view.direction(u), view.pdf_solid_angle(), mi.UInt32(0)
        else:
            columns, density = luminaire.network("sampler")(point, u)
            direction, answer = finite(mi.Vector3f(*columns)), finite(density.item())
            toward, pdf = direction.value, dr.select(direction.spoilt > 0, 0, answer.value)
            spoilt = direction.spoilt | answer.spoilt
        return Direction(toward, pdf, mi.Color3f(dr.select(pdf > 0, 1 / pdf, 0)), spoilt)

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
    ) -> Direction:
        if not self._batched[self._luminaires.index(luminaire)]:
            (cells,) = luminaire.network("fast_map")(point)
            drawn = draw(lit(cells, luminaire.flux), u)
        view = _cap(luminaire, point)
        pdf = view.pdf_solid_angle()
        weight = finite(dr.select(view.outside, drawn.weight / pdf, 0))
        toward, spoilt = view.direction(drawn.square), weight.spoilt | drawn.spoilt
        return Direction(toward, _favoured(pdf), weight.value, spoilt)

    def _each(
        self, asset: mi.UInt32, active: mi.Bool, function: Callable[..., Found],
        arguments: Sequence[Any], default: Found,
    ) -> Found:  # fmt: skip
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


def finite(value: Any) -> Answer:
    """An answer, from which infinite and NaN have been taken out."""
    finite = dr.isfinite(value)
    good = dr.all(finite) if dr.depth_v(value) > 1 else finite
    return Answer(dr.select(good, value, 0), dr.select(good, mi.UInt32(0), mi.UInt32(1)))
