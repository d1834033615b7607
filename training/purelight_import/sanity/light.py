"""How much of each emitter's light leaves the lamp, and in what form."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_import.sanity.subject import Floats, Subject

PATHS, MOST = 1 << 12, 1 << 18
BOUNCES = 96
LIFT = 1e-5  # of the extent


@dataclass(frozen=True)
class Leaving:
    """Light of each emitter in W per channel.

    Arguments:
        emitted: [E, 3].
        left: [E, 3] of it that leaves the lamp within `BOUNCES` events.
        needles: [E, 3] of that which has met nothing but mirrors and clear glass since it left an
            emitter without area, and so has no radiance.
    """

    emitted: Floats
    left: Floats
    needles: Floats


def leaving(subject: Subject, seed: int = 0) -> Leaving:
    """Traces light out of the emitters; media are taken as clear."""
    scene, count = subject.scene, len(subject.scene.emitters())
    each = max(64, min(PATHS, MOST // count))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count * each)
    index = dr.arange(mi.UInt32, count * each) // each
    emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), index)
    ray, weight, sized = _emit(subject, emitter, sampler)
    weight = dr.select(dr.isfinite(weight), weight, 0)
    emitted = _sums(weight, each)
    sharp, active = mi.Bool(~sized), dr.max(weight) > 0
    left, needles = np.zeros_like(emitted), np.zeros_like(emitted)
    for _ in range(BOUNCES):
        si = scene.ray_intersect(ray, active)
        gone = active & ~si.is_valid()
        left += _sums(dr.select(gone, weight, 0), each)
        needles += _sums(dr.select(gone & sharp, weight, 0), each)
        active = active & si.is_valid()
        context = mi.BSDFContext(mi.TransportMode.Importance)
        sample, value = si.bsdf(ray).sample(
            context, si, sampler.next_1d(active), sampler.next_2d(active), active
        )
        weight = dr.select(active, weight * dr.select(dr.isfinite(value), value, 0), weight)
        delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta) | mi.has_flag(
            sample.sampled_type, mi.BSDFFlags.Null
        )
        sharp = sharp & (delta | ~active)
        active = active & (dr.max(weight) > 0)
        ray = dr.select(active, si.spawn_ray(si.to_world(sample.wo)), ray)
        dr.eval(ray, weight, sharp, active)
        if not bool(dr.any(active)):
            break
    return Leaving(emitted, left, needles)


def _emit(
    subject: Subject, emitter: mi.EmitterPtr, sampler: mi.Sampler
) -> tuple[mi.Ray3f, mi.Color3f, mi.Bool]:
    """Rays from emitters, W per channel of each, and whether the emitters have an area."""
    place, turn = sampler.next_2d(), sampler.next_2d()
    shape = emitter.get_shape()
    sized = shape != dr.zeros(mi.ShapePtr)
    point = shape.sample_position(mi.Float(0), place, sized)
    si = mi.SurfaceInteraction3f(point, mi.Color0f())
    si.wi = mi.warp.square_to_cosine_hemisphere(turn)
    direction = si.to_world(si.wi)
    ray = mi.Ray3f(si.p + si.n * (LIFT * subject.extent), direction)
    weight = emitter.eval(si, sized) * (dr.pi * dr.rcp(point.pdf))
    if not bool(dr.all(sized)):
        other, value = emitter.sample_ray(mi.Float(0), sampler.next_1d(), place, turn, ~sized)
        ray, weight = dr.select(sized, ray, other), dr.select(sized, weight, value)
    return ray, weight, sized


def _sums(weight: mi.Color3f, each: int) -> Floats:
    """Mean over the paths of each emitter: [E, 3]."""
    values = np.array(weight, np.float64)
    values = np.broadcast_to(values.reshape(3, -1), (3, values.size // 3))
    return values.reshape(3, -1, each).mean(2).T
