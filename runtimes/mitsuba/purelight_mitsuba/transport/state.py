"""What is known of a path between two bounces, one path a lane."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.table import Lamps
from purelight_mitsuba.transport.light import Light
from purelight_mitsuba.transport.segment import NONE, Segment


def on_no_lamp() -> tuple[mi.UInt32, mi.UInt32]:
    """Of what is on no lamp: `Vertex.own` and `Vertex.skip`."""
    return mi.UInt32(NONE), mi.UInt32(NONE)


@dataclass
class Departure:
    """How a path left its last vertex.

    Arguments:
        vertex: Where that is.
        pdf_solid_angle: Density of the direction.
        delta: Whether no other technique could have found the direction.
        own, skip: As those of `Vertex`.
        shone: As that of `Segment`.
    """

    vertex: mi.Interaction3f
    pdf_solid_angle: mi.Float
    delta: mi.Bool
    own: mi.UInt32
    skip: mi.UInt32
    shone: mi.UInt32


@dataclass
class Path:
    """The state of one path per lane.

    Arguments:
        ray: To its next surface.
        throughput: Of all surfaces and lamps so far.
        eta: Product of the relative indices of refraction so far.
        departure: From its last vertex, at first from the camera.
        shadow_rays: Of its last vertex, which are still to be followed.
        light: For the pixel, so far.
        depth: How many surfaces it has met.
        seen: Whether the pixel shows anything.
        active: Whether it goes on.
    """

    ray: mi.Ray3f
    throughput: mi.Color3f
    eta: mi.Float
    departure: Departure
    shadow_rays: list[Segment]
    light: Light
    depth: mi.UInt32
    seen: mi.Bool
    active: mi.Bool

    @staticmethod
    def begin(
        ray: mi.RayDifferential3f, shadow_rays: list[Segment], groups: int, active: mi.Bool
    ) -> Path:
        """A path at the camera."""
        nothing = dr.zeros(mi.Interaction3f)
        camera = Departure(nothing, mi.Float(1), mi.Bool(True), *on_no_lamp(), mi.UInt32(NONE))
        return Path(
            mi.Ray3f(ray), mi.Color3f(1), mi.Float(1), camera, shadow_rays, Light.dark(groups),
            mi.UInt32(0), mi.Bool(False), mi.Bool(active),
        )  # fmt: skip

    def pending(self) -> mi.Bool:
        """Whether it goes on, or a shadow ray is still to be followed."""
        pending = self.active
        for segment in self.shadow_rays:
            pending = pending | segment.active
        return pending


@dataclass
class Vertex:
    """Where rays end in the room, or at a lamp.

    Arguments:
        found: Mitsuba's note of it, of which the others are made.
        si: Not valid where rays leave the room.
        own: The lamp it is on, or NONE. That lamp's light is known there, and does not count.
        skip: The same where the path goes on behind the lamp.
    """

    ray: mi.Ray3f
    found: mi.PreliminaryIntersection3f
    si: mi.SurfaceInteraction3f
    bsdf: mi.BSDFPtr
    own: mi.UInt32
    skip: mi.UInt32

    @staticmethod
    def of(
        ray: mi.Ray3f,
        found: mi.PreliminaryIntersection3f,
        lamps: Lamps | None = None,
        active: bool | mi.Bool = True,
    ) -> Vertex:
        """A vertex.

        Arguments:
            lamps: Those that it may be on.
        """
        si, on = found.compute_surface_interaction(ray, mi.RayFlags.All, active), on_no_lamp()
        if lamps is not None and lamps.finished:
            si, on = lamps.exits.in_world(si, found, ray), lamps.exits.owner(found)
        return Vertex(ray, found, si, si.bsdf(ray), *on)
