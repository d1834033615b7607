"""Straight-through throughput of lines through a lamp: what the transparency network learns."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.media import Media
from purelight_train.light.rays import leave, scene_extent

MAX_CROSSINGS = 64
MAX_EVENTS = 1 << 12  # crossings and collisions with heterogeneous media together


@dr.syntax
def _throughput(scene: Any, media: Media, extent: Any, ray: Any, sampler: Any) -> Any:
    context = mi.BSDFContext(mi.TransportMode.Importance)
    throughput, crossings, events = mi.Color3f(1), mi.UInt32(0), mi.UInt32(0)
    medium = dr.zeros(mi.MediumPtr)
    active = mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        flight = media.fly(medium, ray, si.t, throughput, sampler, active)
        throughput = dr.select(active, flight.weight, throughput)
        met = active & si.is_valid() & ~flight.collided
        sample, weight = si.bsdf(ray).sample(
            context, si, sampler.next_1d(met), sampler.next_2d(met), met
        )
        through = mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(sample.wo) < 0
        throughput = dr.select(met, throughput * dr.select(through, weight, 0), throughput)
        medium = media.behind(si, ray.d, medium, met)
        ray = dr.select(met, leave(si.p, si.n, ray.d, extent), ray)
        # Ratio tracking: what a collision neither absorbs nor scatters goes on
        if dr.hint(media.present, mode="scalar"):
            passed = throughput * flight.interaction.sigma_n
            throughput = dr.select(flight.collided, passed, throughput)
            ray = dr.select(flight.collided, mi.Ray3f(flight.interaction.p, ray.d), ray)
        crossings = dr.select(met, crossings + 1, crossings)
        events += 1
        active &= (met | flight.collided) & (dr.max(throughput) > 0)
        active &= (crossings < MAX_CROSSINGS) & (events < MAX_EVENTS)
    return dr.select((crossings < MAX_CROSSINGS) & (events < MAX_EVENTS), throughput, 0)


def straight_throughput(
    scene: Any, origin: NDArray[np.float32], direction: NDArray[np.float32], seed: int
) -> NDArray[np.float32]:
    """One random throughput per straight line, ignoring refraction: [N, 3], [N, 3] -> [N, 3].

    At each surface the material's own sampling decides between reflection (throughput zero) and
    transmission (its weight); the mean is the transmittance of any material, rough or smooth.
    Media inside the lamp attenuate what crosses them; light they scatter is lost to the line.
    """
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(origin))
    ray = mi.Ray3f(
        mi.Point3f(np.ascontiguousarray(origin.T)), mi.Vector3f(np.ascontiguousarray(direction.T))
    )
    extent = dr.opaque(mi.Float, scene_extent(scene))
    media = Media(scene, scattering=False)
    value = np.array(_throughput(scene, media, extent, ray, sampler)).T
    return np.nan_to_num(value, nan=0.0, posinf=1.0).astype(np.float32)
