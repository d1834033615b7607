"""Where light paths begin: emitters drawn by their power, and the rays they send out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.painted import on_a_face, painted
from purelight_train.light.rays import leave

PILOT_RAYS = 1 << 16
LEAST_PILOT_RAYS = 64
UNIFORM_SHARE = 0.01  # keeps emitters that the pilot misjudged


@dataclass
class Emitted:
    """The beginning of a path.

    Arguments:
        position: on the emitter; the ray begins a little off it.
        shape: the emitter's, null without.
        weight: W per channel: emitted radiance times cosine over the probability density of what
            was drawn.
    """

    ray: mi.Ray3f
    position: mi.Point3f
    emitter: mi.EmitterPtr
    shape: mi.ShapePtr
    weight: mi.Color3f


@dataclass(frozen=True)
class Emission:
    """The emitters of a scene and the probability with which a path begins at each.

    Arguments:
        emitters: pointers to them, [E].
        shapes: the shape of each, null without: [E].
        extent: size of the scene (`rays.scene_extent`).
        probability: [E], sums to one.
        painted: by the number of an emitter, the areas of the faces of a mesh that shines in
            colours of its own vertices or faces.
    """

    emitters: mi.EmitterPtr
    shapes: mi.ShapePtr
    extent: mi.Float
    probability: NDArray[np.float64]
    painted: dict[int, mi.DiscreteDistribution]

    @staticmethod
    def of(scene: mi.Scene, extent: mi.Float) -> Emission:
        """Emitters in proportion to their power, which a pilot measures that joins no result.

        An area light of one radiance gives every pilot ray the same weight, so that its power,
        pi * area * radiance, is exact; the power of other emitters is estimated.
        """
        emitters = scene.emitters_dr()
        even = np.full(len(emitters), 1 / len(emitters))
        uniform = Emission(emitters, emitter_shapes(scene), extent, even, painted(scene))
        return replace(uniform, probability=_probability(uniform.power()))

    def at(self, index: mi.UInt32) -> tuple[mi.EmitterPtr, mi.ShapePtr]:
        """Emitters by their number, and their shapes."""
        emitter = dr.gather(mi.EmitterPtr, self.emitters, index)
        return emitter, dr.gather(mi.ShapePtr, self.shapes, index)

    def power(self) -> NDArray[np.float64]:
        """Power that each emitter sends out in W per channel: [E, 3]."""
        weight = self._pilot_weights()
        return np.where(np.isfinite(weight), weight, 0).mean(2).T

    def broken(self) -> NDArray[np.float64]:
        """Share of each emitter's rays whose power is not finite: [E]."""
        share: NDArray[np.float64] = (~np.isfinite(self._pilot_weights())).any(0).mean(1)
        return share

    def _pilot_weights(self) -> NDArray[np.float64]:
        """Power of the same few rays of every emitter, in W: [3, E, rays]."""
        count = len(self.probability)
        rays = max(LEAST_PILOT_RAYS, PILOT_RAYS // count)
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(0, count * rays)
        index = dr.arange(mi.UInt32, count * rays) // rays
        weight = np.array(self._emit(index, sampler).weight, np.float64)
        return weight.reshape(3, count, rays)

    def brightest(self) -> NDArray[np.float64]:
        """Largest radiance of the emitters in W/(m² sr) per channel, [3]; infinite without area.

        Optics without gain pass it on, divided by the square of an index, so that no radiance
        outside is larger. Textures are sampled, and come out a little too dark at worst.
        """
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(1, PILOT_RAYS)
        index = mi.UInt32(sampler.next_1d() * len(self.probability))
        emitter, shape = self.at(index)
        area_light = shape != dr.zeros(mi.ShapePtr)
        si, _ = self.place(index, sampler.next_2d())
        si.wi = mi.Vector3f(0, 0, 1)
        value = dr.select(area_light, emitter.eval(si, area_light), dr.inf)
        return np.array(dr.max(value, axis=1), np.float64).reshape(3)

    def sample(self, sampler: mi.Sampler) -> Emitted:
        """Begin one path a lane: draw emitter, point and direction."""
        choice = mi.DiscreteDistribution(mi.Float(self.probability.astype(np.float32)))
        index, probability = choice.sample_pmf(sampler.next_1d())
        emitted = self._emit(index, sampler)
        return replace(emitted, weight=emitted.weight / probability)

    def place(
        self, index: mi.UInt32, sample: mi.Point2f
    ) -> tuple[mi.SurfaceInteraction3f, mi.Float]:
        """A point on the shapes of emitters of given numbers, and its density per area.

        It lacks `wi`, and holds nothing for emitters without a shape.
        """
        _, shape = self.at(index)
        point = shape.sample_position(mi.Float(0), sample, shape != dr.zeros(mi.ShapePtr))
        si = mi.SurfaceInteraction3f(point, mi.Color0f())
        si.shape = shape
        for number, areas in self.painted.items():
            si = dr.select(index == number, on_a_face(shape, areas, sample, index == number), si)
        return si, point.pdf

    def _emit(self, index: mi.UInt32, sampler: mi.Sampler) -> Emitted:
        """Draw point and direction for emitters of given numbers.

        Area lights are sampled by area and cosine here, not by `sample_ray`: that lifts rays off
        as `spawn_ray` does (see `rays.leave`), and maps textures onto shapes by inverting UVs,
        which must then be a bijection.
        """
        position, direction = sampler.next_2d(), sampler.next_2d()
        emitter, shape = self.at(index)
        nothing = dr.zeros(mi.ShapePtr)
        area_light = shape != nothing
        si, density = self.place(index, position)
        si.wi = mi.warp.square_to_cosine_hemisphere(direction)
        ray = leave(si.p, si.n, si.to_world(si.wi), self.extent)
        weight = emitter.eval(si, area_light) * (dr.pi * dr.rcp(density))
        choice = mi.Float(0) if bool(dr.all(self.shapes != nothing)) else sampler.next_1d()
        for one, mine in self._bare(index, emitter, ~area_light):
            other, value = one.sample_ray(mi.Float(0), choice, position, direction, mine)
            ray, weight = dr.select(mine, other, ray), dr.select(mine, value, weight)
        point = dr.select(area_light, si.p, ray.o)
        return Emitted(ray, mi.Point3f(point), emitter, shape, weight)

    def _bare(
        self, index: mi.UInt32, emitter: mi.EmitterPtr, bare: mi.Bool
    ) -> list[tuple[Any, mi.Bool]]:
        """Emitters without a shape, and which of the rays are theirs.

        One by one where a mesh is painted: `EmitterPtr.sample_ray` asks every emitter, and such a
        mesh cannot tell.
        """
        shapeless = [number for number, shape in enumerate(self.shapes) if shape is None]
        if not shapeless:
            return []
        if not self.painted:
            return [(emitter, bare)]
        return [(self.emitters[number], index == number) for number in shapeless]


def emitter_shapes(scene: mi.Scene) -> mi.ShapePtr:
    """The shape of each emitter of a scene, null without: [E].

    Each is asked alone: `EmitterPtr.get_shape` asks every emitter of the process, and fails at one
    that outlived its shape.
    """
    return mi.ShapePtr([emitter.get_shape() for emitter in scene.emitters()])


def _probability(power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Mean over the channels of each emitter's share of a channel: [E, 3] -> [E].

    Every channel is learned on its own, so a faint blue LED beside a bright red one gets paths.
    """
    total = power.sum(0)
    lit = total > 0
    if not lit.any():
        return np.full(len(power), 1 / len(power))
    share = (power[:, lit] / total[lit]).mean(1)
    return (1 - UNIFORM_SHARE) * share + UNIFORM_SHARE / len(power)
