"""What an unlit lamp lets through of an even bright background, path traced.

A camera ray that the lamp's first surface reflects shows what is in front or beside, which is no
transmittance: only rays that pass that surface count, wherever they leave into the half-space
behind. Mitsuba's materials in its own direction, from the camera, are followed through an enlarged
lamp, by nothing of our light tracer but the closed form of absorption.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.media import Media
from purelight_train.truth.picture import Passes, Picture
from purelight_train.truth.thin_lens import ThinLens

MAX_DEPTH = 64


def seen_through(lamp: dict[str, Any], lens: ThinLens, spp: int) -> Picture:
    """Light of a background of radiance one that reaches each pixel: one where nothing is hit.

    Arguments:
        lamp: its shapes; light they scatter in media is lost.
        spp: an even number of rays a pixel.
    """
    scene = mi.load_dict({"type": "scene", **lamp})
    media, passes = Media(scene, scattering=False), Passes()
    for seed in range(spp):
        rng = np.random.default_rng([6, seed])
        value = _trace(scene, media, *lens.rays(rng), lens.camera.axes[2], seed)
        passes.add(value.reshape(lens.size, lens.size, 3))
    return passes.picture()


def _trace(
    scene: Any, media: Media, origin: NDArray[Any], direction: NDArray[Any],
    back: NDArray[np.float64], seed: int,
) -> NDArray[np.float64]:  # fmt: skip
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(origin))
    ray = mi.Ray3f(
        mi.Point3f(np.ascontiguousarray(origin.T)), mi.Vector3f(np.ascontiguousarray(direction.T))
    )
    value = _follow(scene, media, ray, mi.Vector3f(*back.tolist()), sampler)
    return np.nan_to_num(np.array(value, np.float64).T)


@dr.syntax
def _follow(scene: Any, media: Media, ray: Any, back: Any, sampler: Any) -> Any:
    """Throughput of rays that leave behind the lamp: a colour each."""
    context = mi.BSDFContext()
    throughput, depth = mi.Color3f(1), mi.UInt32(0)
    medium = dr.zeros(mi.MediumPtr)
    escaped, active = mi.Bool(False), mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, active)
        flight = media.fly(medium, ray, si.t, throughput, sampler, active)
        throughput = dr.select(active, flight.weight, throughput)
        met = active & si.is_valid()
        escaped |= active & ~si.is_valid()
        sample, weight = si.bsdf(ray).sample(
            context, si, sampler.next_1d(met), sampler.next_2d(met), met
        )
        passed = mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(sample.wo) < 0
        weight = dr.select(passed | (depth > 0), weight, 0)
        throughput = dr.select(met, throughput * weight, throughput)
        onward = si.spawn_ray(si.to_world(sample.wo))
        medium = media.behind(si, onward.d, medium, met)
        ray = dr.select(met, onward, ray)
        depth = dr.select(met, depth + 1, depth)
        active = met & (dr.max(throughput) > 0) & (depth < MAX_DEPTH)
    return dr.select(escaped & (dr.dot(ray.d, back) < 0), throughput, 0)
