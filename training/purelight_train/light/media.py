"""Participating media: flights through them, attenuated or scattered, in three channels at once."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

FARTHEST = 1e30


@dataclass(frozen=True)
class Flight:
    """What a flight through a medium came to.

    Arguments:
        weight: path weight after it.
        collided: whether it ended in the medium, not at the surface ahead.
        interaction: where, with the coefficients there.
    """

    weight: mi.Color3f
    collided: mi.Bool
    interaction: mi.MediumInteraction3f


@dataclass(frozen=True)
class Collision:
    """What became of light that collided with a medium.

    Arguments:
        direction: unit vector, in which it goes on.
        weight: path weight after it.
        scattered: whether it was; otherwise it passed on.
    """

    direction: mi.Vector3f
    weight: mi.Color3f
    scattered: mi.Bool


class Media:
    """The media inside, around and between the shapes of a scene.

    Arguments:
        scattering: follow scattered light. Homogeneous media attenuate in closed form, by Beer's
            law, where nothing is scattered; with `scattering` false that is everywhere.

    Attributes:
        present: whether there are any; without, nothing here costs anything.
        closed_form: by a medium's registry index, whether it attenuates in closed form.
    """

    def __init__(self, scene: mi.Scene, *, scattering: bool) -> None:
        found = [m for m in _media(scene) if m is not None]
        self.present = bool(found)
        pointers = mi.MediumPtr(found) if found else dr.zeros(mi.MediumPtr)
        index = [int(i) for i in dr.reinterpret_array(mi.UInt32, pointers)]
        table = [False] * (max(index) + 1)
        for i, medium in zip(index, found, strict=False):
            table[i] = medium.is_homogeneous() and not (scattering and _scatters(medium))
        self.closed_form = mi.Bool(table)

    def behind(
        self, si: mi.SurfaceInteraction3f, direction: mi.Vector3f, medium: mi.MediumPtr,
        active: mi.Bool,
    ) -> mi.MediumPtr:  # fmt: skip
        """The medium that a ray leaving a surface enters; the present one off boundaries."""
        if not self.present:
            return medium
        return dr.select(active & si.is_medium_transition(), si.target_medium(direction), medium)

    def around(self, emitter: mi.EmitterPtr, shape: mi.ShapePtr) -> mi.MediumPtr:
        """The medium that emitters, or their shapes, shine into."""
        if not self.present:
            return dr.zeros(mi.MediumPtr)
        own, nothing = emitter.get_medium(), dr.zeros(mi.MediumPtr)
        return dr.select(own != nothing, own, shape.exterior_medium())

    def fly(
        self, medium: mi.MediumPtr, ray: mi.Ray3f, distance: mi.Float, weight: mi.Color3f,
        sampler: mi.Sampler, active: mi.Bool,
    ) -> Flight:  # fmt: skip
        """Fly to the surface at `distance`, or to a collision before it.

        The channel that chooses the distance is drawn in proportion to the weight, and the weight
        divided by the mean density over the channels: its sum never grows, whereas one channel's
        density alone can be smaller than another's transmittance by any factor.
        """
        if not self.present:
            return Flight(weight, mi.Bool(False), dr.zeros(mi.MediumInteraction3f))
        inside = active & (medium != dr.zeros(mi.MediumPtr))
        closed = inside & dr.gather(
            mi.Bool, self.closed_form, dr.reinterpret_array(mi.UInt32, medium), inside
        )
        random = inside & ~closed
        share = weight / dr.sum(weight)
        u = sampler.next_1d(random)
        channel = dr.select(u < share.x, mi.UInt32(0), dr.select(u < share.x + share.y, 1, 2))
        mei = medium.sample_interaction(ray, sampler.next_1d(random), channel, random)
        collided = random & mei.is_valid() & (mei.t < distance)
        far = dr.minimum(distance, FARTHEST)
        length = dr.maximum(dr.select(collided, mei.t, far) - mei.mint, 0)
        transmittance = dr.exp(-length * mei.combined_extinction)
        density = dr.sum(
            share * transmittance * dr.select(collided, mei.combined_extinction, mi.Color3f(1))
        )
        absorbed = dr.exp(-far * medium.get_majorant(mei, closed))
        weight = dr.select(random, weight * transmittance / density, weight)
        return Flight(dr.select(closed, weight * absorbed, weight), collided, mei)

    def scatter(self, medium: mi.MediumPtr, flight: Flight, sampler: mi.Sampler) -> Collision:
        """Decide what a collision is: scattered light, or nothing (heterogeneous media).

        Absorption lowers the weight in both cases.
        """
        mei, active = flight.interaction, flight.collided
        real = dr.sum(flight.weight * mei.sigma_s)
        null = dr.sum(flight.weight * mei.sigma_n)
        scattered = active & (sampler.next_1d(active) * (real + null) < real)
        factor = (real + null) * dr.select(scattered, mei.sigma_s / real, mei.sigma_n / null)
        weight = dr.select(real + null > 0, flight.weight * factor, 0)
        context = mi.PhaseFunctionContext(None, mi.TransportMode.Importance)
        direction, value, _ = medium.phase_function().sample(
            context, mei, sampler.next_1d(scattered), sampler.next_2d(scattered), scattered
        )
        turned = dr.select(scattered, direction, -mei.wi)
        return Collision(turned, dr.select(scattered, weight * value, weight), scattered)


def _media(scene: mi.Scene) -> list[mi.Medium | None]:
    shapes, emitters = scene.shapes_dr(), scene.emitters_dr()
    return [
        *shapes.interior_medium(), *shapes.exterior_medium(), *emitters.get_medium(),
    ]  # fmt: skip


def _scatters(medium: mi.Medium) -> bool:
    """Whether a medium's albedo is above zero anywhere."""
    return any(
        bool(dr.any(value > 0, axis=None))
        for name, value in mi.traverse(medium)
        if name.startswith("albedo") and dr.is_float_v(value)
    )
