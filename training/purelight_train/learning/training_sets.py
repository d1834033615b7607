"""What student, transparency and sampler are trained on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from purelight_train.learning.cap_samples import CapSamples
from purelight_train.learning.teacher import Teacher
from purelight_train.light.exit_surface import ExitSurface, inward_rays
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.throughput import straight_throughput

Float = NDArray[np.float32]
SurfaceSet = tuple[Float, Float, Float, Float]
RAYS = 1 << 18


def distillation_set(
    surface: ExitSurface,
    teacher: Teacher,
    samples: int,
    rng: np.random.Generator,
    progress: Callable[[int], None],
) -> SurfaceSet:
    """Rays from outside, and the teacher's radiance where they meet the lamp (Sec. 3.3).

    Half of the rays are uniform lines through the sphere, half uniform on the hemisphere as in
    the paper, which favours grazing views.

    Returns:
        position, normal, outgoing and radiance, each [N, 3] with N >= samples.
    """
    parts: list[SurfaceSet] = []
    done = 0
    while done < samples:
        origin, direction = inward_rays(surface.sphere, RAYS, rng, cosine=bool(len(parts) % 2))
        hits = surface.intersect(origin, direction)
        outgoing = -direction[hits.index]
        radiance = teacher.radiance(hits.position, hits.normal, outgoing)
        parts.append((hits.position, hits.normal, outgoing, radiance))
        done += len(hits.index)
        progress(done)
    position, normal, outgoing, radiance = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return position, normal, outgoing, radiance


def throughput_set(
    luminaire: Luminaire, samples: int, rng: np.random.Generator, seed: int
) -> SurfaceSet:
    """Lines through the lamp and a random straight-through throughput of each.

    Returns:
        position, normal, outgoing and throughput, each [N, 3].
    """
    surface = luminaire.exit_surface
    origin, direction = inward_rays(surface.sphere, samples, rng, cosine=True)
    hits = surface.intersect(origin, direction)
    origin, direction = origin[hits.index], direction[hits.index]
    value = straight_throughput(luminaire.scene, origin, direction, seed)
    return hits.position, hits.normal, -direction, value


class SamplerBatches:
    """Directions towards the lamp, drawn by the luminance seen along them.

    Points are uniform among those that see any light; within a point's cap, cells are drawn in
    proportion to their luminance, which is the weight of the Kullback-Leibler divergence.
    """

    def __init__(self, samples: CapSamples) -> None:
        self.samples = samples
        share = samples.luminance().astype(np.float64)
        self.lit = np.flatnonzero(share.sum(1) > 0)
        share = share[self.lit]
        self.cumulative = np.cumsum(share / share.sum(1, keepdims=True))

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Float, Float]:
        """Cap coordinates [size, 2] and shading points [size, 3]."""
        u = rng.random(size) * self.cumulative[-1]
        index = np.minimum(np.searchsorted(self.cumulative, u), len(self.cumulative) - 1)
        cells = self.samples.square.shape[1]
        point, cell = self.lit[index // cells], index % cells
        return self.samples.square[point, cell], self.samples.point[point]
