"""Transparency (paper Sec. 3.3): RGB throughput straight through the whole lamp."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_train.description import Description
from purelight_train.presets import Preset
from purelight_train.surface_network import SurfaceNetwork

DEGREE = 3
MAX_CROSSINGS = 64


class Transparency(SurfaceNetwork):
    """Transmittance in [0, 1] per channel, for the line that enters at position along -outgoing."""

    def __init__(self, description: Description, preset: Preset) -> None:
        super().__init__(
            description, preset.transparency_grid, DEGREE, preset.transparency_network
        )

    def forward(self, position: Tensor, normal: Tensor, outgoing: Tensor) -> Tensor:
        """Transmittance: three of [N, 3] -> [N, 3]."""
        return torch.sigmoid(self.raw(position, normal, outgoing))

    def loss(
        self, position: Tensor, normal: Tensor, outgoing: Tensor, throughput: Tensor
    ) -> Tensor:
        """Mean square error, whose minimiser is the mean of the random throughputs."""
        return ((self(position, normal, outgoing) - throughput) ** 2).mean()


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
