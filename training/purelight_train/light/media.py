"""Participating media: flights through them, attenuated or scattered, in three channels at once."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_train.light.emission import emitter_shapes
from purelight_train.light.rays import leave, scene_extent

FARTHEST = 1e30
SURFACES = 64  # that are looked through for the one that bounds a medium
RAYS = 33  # of each emitter that are asked which medium it stands in


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
        lit = self.present and scene.emitters()
        self._around = _surroundings(scene) if lit else mi.UInt32(0)

    def behind(
        self, si: mi.SurfaceInteraction3f, direction: mi.Vector3f, medium: mi.MediumPtr,
        active: mi.Bool,
    ) -> mi.MediumPtr:  # fmt: skip
        """The medium that a ray leaving a surface enters; the present one off boundaries."""
        if not self.present:
            return medium
        return dr.select(active & si.is_medium_transition(), si.target_medium(direction), medium)

    def around(self, emitter: mi.EmitterPtr, shape: mi.ShapePtr) -> mi.MediumPtr:
        """The medium that emitters shine into: that they or their shapes state, or stand in."""
        nothing = dr.zeros(mi.MediumPtr)
        if not self.present:
            return nothing
        own, stated = emitter.get_medium(), shape.exterior_medium()
        index = dr.gather(mi.UInt32, self._around, dr.reinterpret_array(mi.UInt32, emitter))
        found = dr.select(stated != nothing, stated, dr.reinterpret_array(mi.MediumPtr, index))
        return dr.select(own != nothing, own, found)

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


def _surroundings(scene: mi.Scene) -> mi.UInt32:
    """By an emitter's registry index, the index of the medium that its shape stands in.

    Paths from a camera end at emitters, and need not know; so scenes seldom state it. Most of the
    rays that leave the shape meet the boundary of that medium from within, if there is one.
    """
    emitters = scene.emitters_dr()
    number = dr.reinterpret_array(mi.UInt32, emitters)
    turn = dr.arange(mi.UInt32, RAYS * len(number)) % len(number)
    shape = dr.gather(mi.ShapePtr, emitter_shapes(scene), turn)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, dr.width(shape))
    start = shape.sample_position(0, sampler.next_2d())
    turned = mi.Frame3f(start.n).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d()))
    medium = _ahead(scene, start, turned, shape != dr.zeros(mi.ShapePtr))
    votes = np.array(medium).reshape(RAYS, -1)
    table = np.zeros(int(np.array(number).max()) + 1, np.uint32)
    table[np.array(number)] = [np.bincount(column).argmax() for column in votes.T]
    return mi.UInt32(table)


def _ahead(
    scene: mi.Scene, start: mi.PositionSample3f, direction: mi.Vector3f, active: mi.Bool
) -> mi.UInt32:
    """The index of the medium on this side of the first boundary that rays meet, or zero."""
    extent, result = scene_extent(scene), mi.UInt32(0)
    ray = leave(start.p, start.n, direction, extent)
    for _ in range(SURFACES):
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        active &= si.is_valid()
        boundary = active & si.is_medium_transition()
        near = dr.reinterpret_array(mi.UInt32, si.target_medium(-direction))
        result = dr.select(boundary, near, result)
        active &= ~boundary
        if not dr.any(active):
            break
        ray = leave(si.p, si.n, direction, extent)
    return result


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
