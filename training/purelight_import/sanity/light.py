"""How much of each emitter's light leaves the lamp, and in what form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_import.sanity.subject import Floats, Subject, lifted

PATHS, MOST = 1 << 12, 1 << 18
BOUNCES = 96


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


def leaving(subject: Subject, seed: int = 0, paths: int = PATHS) -> Leaving:
    """Traces light out of the emitters, so many paths each at most; media are taken as clear."""
    scene = subject.scene
    count = len(scene.emitters())
    each = max(64, min(paths, MOST // count))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count * each)
    index = dr.arange(mi.UInt32, count * each) // each
    emitter = dr.gather(mi.EmitterPtr, scene.emitters_dr(), index)
    ray, weight, sized = _emit(subject, index, emitter, sampler)
    weight = dr.select(dr.all(dr.isfinite(weight)), weight, 0)
    thin = ~sized & mi.has_flag(emitter.flags(), mi.EmitterFlags.DeltaPosition)
    left, sharp = _walk(scene, subject.extent, sampler, ray, weight, thin)
    dr.eval(weight, left, sharp)  # once, or each array below would run the loop again
    return Leaving(_sums(weight, each), _sums(left, each), _sums(dr.select(sharp, left, 0), each))


@dr.syntax
def _walk(
    scene: mi.Scene,
    extent: float,
    sampler: mi.Sampler,
    ray: mi.Ray3f,
    weight: mi.Color3f,
    sharp: mi.Bool,
) -> tuple[mi.Color3f, mi.Bool]:
    """Follows light until it leaves.

    Returns:
        What is left of each path's weight when it does, and whether nothing ever scattered it.
    """
    left, events = mi.Color3f(0), mi.UInt32(0)
    active = dr.max(weight) > 0
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        left = dr.select(active & ~si.is_valid(), weight, left)
        active &= si.is_valid()
        sample, value = si.bsdf(ray).sample(
            mi.BSDFContext(mi.TransportMode.Importance), si, sampler.next_1d(active),
            sampler.next_2d(active), active,
        )  # fmt: skip
        weight = dr.select(active, weight * value, weight)
        straight = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        straight |= mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        sharp &= straight | ~active
        direction = si.to_world(sample.wo)
        active &= dr.all(dr.isfinite(weight)) & (dr.max(weight) > 0)
        ray = dr.select(active, lifted(si.p, si.n, direction, extent), ray)
        events += 1
        active &= events < BOUNCES
    return left, sharp


def _emit(
    subject: Subject, index: mi.UInt32, emitter: mi.EmitterPtr, sampler: mi.Sampler
) -> tuple[mi.Ray3f, mi.Color3f, mi.Bool]:
    """Rays from emitters, W per channel of each, and whether the emitters have an area."""
    place, turn = sampler.next_2d(), sampler.next_2d()
    shape = dr.gather(mi.ShapePtr, subject.emitter_shapes, index)
    sized = shape != dr.zeros(mi.ShapePtr)
    point = shape.sample_position(mi.Float(0), place, sized)
    si = mi.SurfaceInteraction3f(point, mi.Color0f())
    si.wi = mi.warp.square_to_cosine_hemisphere(turn)
    direction = si.to_world(si.wi)
    ray = lifted(si.p, si.n, direction, subject.extent)
    weight = emitter.eval(si, sized) * (dr.pi * dr.rcp(point.pdf))
    if bool(dr.all(sized)):
        return ray, weight, sized
    choice, emitters = sampler.next_1d(), subject.scene.emitters()
    for one, mine in _bare(emitter, emitters, index, sized):
        other, value = one.sample_ray(mi.Float(0), choice, place, turn, mine)
        ray, weight = dr.select(mine, other, ray), dr.select(mine, value, weight)
    return ray, weight, sized


def _bare(
    emitter: mi.EmitterPtr, emitters: list[mi.Emitter], index: mi.UInt32, sized: mi.Bool
) -> list[tuple[Any, mi.Bool]]:
    """Emitters without an area, and which of the rays are theirs.

    One by one where a mesh shines in colours of its own: `EmitterPtr.sample_ray` asks every
    emitter, and such a mesh cannot tell.
    """
    if not any("MeshAttribute[" in str(one) for one in emitters):
        return [(emitter, ~sized)]
    bare = [n for n, one in enumerate(emitters) if one.get_shape() is None]
    return [(emitters[n], index == n) for n in bare]


def _sums(weight: mi.Color3f, each: int) -> Floats:
    """Mean over the paths of each emitter: [E, 3]."""
    values = np.array(weight, np.float64)
    values = np.broadcast_to(values.reshape(3, -1), (3, values.size // 3))
    return values.reshape(3, -1, each).mean(2).T
