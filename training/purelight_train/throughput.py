"""Straight-through throughput of lines through a lamp: what the transparency network learns."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

MAX_CROSSINGS = 64


@dr.syntax
def _throughput(scene: Any, ray: Any, sampler: Any) -> Any:
    context = mi.BSDFContext(mi.TransportMode.Importance)
    throughput, crossings = mi.Color3f(1), mi.UInt32(0)
    active = mi.Bool(True)
    while active:
        si = scene.ray_intersect(ray, mi.RayFlags.All, coherent=False, active=active)
        active &= si.is_valid()
        sample, weight = si.bsdf(ray).sample(
            context, si, sampler.next_1d(active), sampler.next_2d(active), active
        )
        through = mi.Frame3f.cos_theta(si.wi) * mi.Frame3f.cos_theta(sample.wo) < 0
        throughput = dr.select(active, throughput * dr.select(through, weight, 0), throughput)
        crossings += 1
        ray = dr.select(active, si.spawn_ray(ray.d), ray)
        active &= (dr.max(throughput) > 0) & (crossings < MAX_CROSSINGS)
    return dr.select(crossings < MAX_CROSSINGS, throughput, 0)


def straight_throughput(
    scene: Any, origin: NDArray[np.float32], direction: NDArray[np.float32], seed: int
) -> NDArray[np.float32]:
    """One random throughput per straight line, ignoring refraction: [N, 3], [N, 3] -> [N, 3].

    At each surface the material's own sampling decides between reflection (throughput zero) and
    transmission (its weight); the mean is the transmittance of any material, rough or smooth.
    """
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, len(origin))
    ray = mi.Ray3f(
        mi.Point3f(np.ascontiguousarray(origin.T)), mi.Vector3f(np.ascontiguousarray(direction.T))
    )
    value = np.array(_throughput(scene, ray, sampler)).T
    return np.nan_to_num(value, nan=0.0, posinf=1.0).astype(np.float32)
