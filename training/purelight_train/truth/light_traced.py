"""Light-traced pictures: every photon that leaves the lamp is imaged by thin lenses.

A path's light reaches a lens in one of two ways, told apart by its last event, so that each is
counted once:

- scattering by a rough or diffuse surface, and emission by an area light, are joined to a random
  point of the lens (next event estimation, as in Mitsuba's `ptracer`);
- light that a smooth surface refracted or mirrored last, that a null surface let through, or that
  comes straight from an emitter without area, is caught when it happens to meet the lens.

Noise of the first is nearly that of a pinhole; noise of the second falls as one over the radius of
the lens. Several lenses share the photons.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_train.light.light_tracing import ESCAPED, Lamp, trace_paths
from purelight_train.light.rays import leave
from purelight_train.light.scattering import Scattered
from purelight_train.truth.lens_film import LensFilm
from purelight_train.truth.picture import Passes, Picture
from purelight_train.truth.thin_lens import ThinLens

BATCH = 1 << 19
CANDIDATES = 4
STAY = 0.9


def light_traced(
    scene: mi.Scene,
    lenses: Sequence[ThinLens],
    paths: int,
    seed: int = 0,
    progress: Callable[[int], None] = lambda _: None,
) -> list[Picture]:
    """Pictures of a lamp through several lenses, unbiased whatever it is made of.

    Arguments:
        scene: that holds only the lamp.
        paths: number of emitted paths, rounded up to an even number of batches of equal size.
        progress: called with the paths done so far.

    Returns:
        one for each lens.
    """
    lamp = Lamp(scene)
    passes = [Passes() for _ in lenses]
    batches = 2 * -(-paths // (2 * BATCH))
    size = -(-paths // batches)
    for batch in range(batches):
        films = [LensFilm(lens) for lens in lenses]
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed((seed * 65_537 + batch) & 0xFFFFFFFF, size)
        _Exposure(lamp, films).expose(sampler)
        for film, sums in zip(films, passes, strict=True):
            sums.add(film.take(size))
        progress((batch + 1) * size)
    return [p.picture() for p in passes]


def sharp_share(scene: mi.Scene, seed: int = 0) -> float:
    """Part of the escaping power that no join can reach, which a lens has to catch: 0 .. 1."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, BATCH)
    traced = trace_paths(Lamp(scene), sampler)
    weight = traced.exit.weight
    power = dr.select((traced.fate == ESCAPED) & dr.all(dr.isfinite(weight)), dr.sum(weight), 0)
    caught = dr.select(traced.sharp, power, 0)
    dr.eval(power, caught)
    return float(np.array(caught, np.float64).sum() / np.array(power, np.float64).sum())


class _Exposure:
    """One batch of paths that draw on films. Not a dataclass, see `light_tracing.Lamp`."""

    def __init__(self, lamp: Lamp, films: Sequence[LensFilm]) -> None:
        self.lamp, self.films = lamp, films

    def expose(self, sampler: mi.Sampler) -> None:
        self._join_emitters(sampler)
        traced = trace_paths(self.lamp, sampler, self._visit)
        dr.eval(traced)
        out, caught = traced.exit, (traced.fate == ESCAPED) & traced.sharp
        for film in self.films:
            film.catch(mi.Ray3f(out.position, out.direction), out.weight, caught)

    def _join_emitters(self, sampler: mi.Sampler) -> None:
        """Join points of area lights to the lenses."""
        emission, scene = self.lamp.emission, self.lamp.scene
        choice = mi.DiscreteDistribution(mi.Float(emission.probability.astype(np.float32)))
        index, probability = choice.sample_pmf(sampler.next_1d())
        emitter, _ = emission.at(index)
        si, density = emission.place(index, sampler.next_2d())
        for film in self.films:
            target = film.point(sampler.next_2d())
            direction = dr.normalize(target - si.p)
            si.wi = si.to_local(direction)
            cosine = mi.Frame3f.cos_theta(si.wi)
            lit = (cosine > 0) & (density > 0)
            value = emitter.eval(si, lit) * (cosine / (density * probability))
            lit &= ~scene.ray_test(leave(si.p, si.n, direction, self.lamp.extent), lit)
            film.join(target, si.p, value, lit)

    def _visit(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, weight: mi.Color3f, sampler: mi.Sampler,
        active: mi.Bool,
    ) -> Scattered:  # fmt: skip
        """Join a surface to the lenses, then scatter."""
        for film in self.films:
            target = film.point(sampler.next_2d(active))
            direction = dr.normalize(target - si.p)
            value = weight * self.lamp.materials.towards(si, ray, direction, active)
            lit = active & (dr.max(value) > 0)
            shadow = leave(si.p, si.n, direction, self.lamp.extent)
            lit &= ~self.lamp.scene.ray_test(shadow, lit)
            film.join(target, si.p, value, lit)
        return self._scatter(si, ray, weight, sampler, active)

    def _scatter(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, weight: mi.Color3f, sampler: mi.Sampler,
        active: mi.Bool,
    ) -> Scattered:  # fmt: skip
        """Scatter; light about to leave rough glass is kept inside where it can be.

        What leaves has mostly been joined to the lenses already and is worth nothing more, whereas
        the little that stays draws the dim parts of the lamp. Of `CANDIDATES` samples, one of the n
        that stay is taken with weight n / CANDIDATES and probability STAY, or else one of those
        that leave likewise: the mean over the choices is the mean of the samples.
        """
        flags = si.bsdf(ray).flags()
        rough = mi.has_flag(flags, mi.BSDFFlags.GlossyTransmission)
        rough &= active & ~mi.has_flag(flags, mi.BSDFFlags.Delta) & (dr.dot(si.n, ray.d) > 0)
        event = self.lamp.scatter(si, ray, weight, sampler, active)
        stayed, left, other = _Choice(), _Choice(), event
        for i in range(CANDIDATES):
            if i > 0:
                other = self.lamp.scatter(si, ray, weight, sampler, rough)
            leaves, u = dr.dot(si.n, other.direction) > 0, sampler.next_1d(rough)
            stayed.offer(other, u, rough & ~leaves)
            left.offer(other, u, rough & leaves)
        stay = dr.select(left.count == 0, 1, dr.select(stayed.count == 0, 0, STAY))
        kept = sampler.next_1d(rough) < stay
        weighed = dr.select(
            kept, stayed.factor * (stayed.count / stay), left.factor * (left.count / (1 - stay))
        )
        chosen = dr.select(kept, stayed.direction, left.direction)
        direction = dr.select(rough, chosen, event.direction)
        factor = dr.select(rough, weighed / CANDIDATES, event.factor)
        return Scattered(direction, factor, event.sharp & ~rough)


class _Choice:
    """One of several samples, each as likely (reservoir sampling)."""

    def __init__(self) -> None:
        self.count = mi.Float(0)
        self.direction, self.factor = mi.Vector3f(0), mi.Color3f(0)

    def offer(self, other: Scattered, u: mi.Float, active: mi.Bool) -> None:
        self.count = dr.select(active, self.count + 1, self.count)
        take = active & (u * self.count < 1)
        self.direction = dr.select(take, other.direction, self.direction)
        self.factor = dr.select(take, other.factor, self.factor)
