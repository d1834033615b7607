"""What student, transparency and sampler are trained on."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from purelight_format.color import LUMINANCE
from purelight_train.learning.cap_samples import CapSamples
from purelight_train.learning.teacher import Teacher
from purelight_train.light.description import Description
from purelight_train.light.exit_surface import ExitSurface, inward_rays
from purelight_train.light.luminaire import Luminaire
from purelight_train.light.transmittance import transmittance_samples

Float = NDArray[np.float32]
SurfaceSet = tuple[Float, Float, Float, Float]
RAYS = 1 << 18
LIFT, CLEAR = 1e-4, 5e-3  # radii


def viewed_rays(
    surface: ExitSurface, count: int, rng: np.random.Generator, *, cosine: bool
) -> tuple[Float, Float, Float]:
    """Where viewers meet the lamp: position, normal and outgoing, each [N, 3] with N <= count.

    Half of them stand outside, on lines through the sphere (`inward_rays`, whose argument is
    `cosine`), and half just before points uniform on the surface, under a shade or between arms
    too.
    """
    origin, direction = inward_rays(surface.sphere, count // 2, rng, cosine=cosine)
    hits = surface.intersect(origin, direction)
    rays = (hits.position, hits.normal, -direction[hits.index])
    near = surface.sample_rays(count - count // 2, rng)
    outside, nearby, outgoing = (np.concatenate(pair) for pair in zip(rays, near, strict=True))
    return outside, nearby, outgoing


def distillation_set(
    surface: ExitSurface,
    teacher: Teacher,
    samples: int,
    rng: np.random.Generator,
    progress: Callable[[int], None],
) -> SurfaceSet:
    """Rays to the lamp, and the teacher's radiance where they meet it (Sec. 3.3).

    Those from outside are uniform lines through the sphere and, as many, uniform on the hemisphere
    as in the paper, which favours grazing views.

    Returns:
        position, normal, outgoing and radiance, each [N, 3] with N >= samples.
    """
    parts: list[SurfaceSet] = []
    done = 0
    while done < samples:
        rays = viewed_rays(surface, RAYS, rng, cosine=bool(len(parts) % 2))
        parts.append((*rays, teacher.radiance(*rays)))
        done += len(rays[0])
        progress(done)
    position, normal, outgoing, radiance = (
        np.concatenate(column) for column in zip(*parts, strict=True)
    )
    return position, normal, outgoing, radiance


def transmittance_set(
    luminaire: Luminaire, samples: int, rng: np.random.Generator, seed: int
) -> SurfaceSet:
    """Lines into the lamp, and a random transmittance of each.

    Returns:
        position, normal, outgoing and transmittance, each [N, 3].
    """
    surface = luminaire.exit_surface
    position, normal, outgoing = viewed_rays(surface, samples, rng, cosine=True)
    start = just_before(surface, position, normal, outgoing)
    value = transmittance_samples(luminaire.scene, start, -outgoing, seed)
    return position, normal, outgoing, value


def just_before(surface: ExitSurface, position: Float, normal: Float, outgoing: Float) -> Float:
    """Points outside of the lamp from which viewers see these: [N, 3].

    They are clear of the surface, which may be a tessellation of the true one, and nearer than
    anything else of the lamp.
    """
    radius = surface.sphere.radius
    free = np.full(len(position), 2 * CLEAR * radius, np.float32)
    hits = surface.intersect(position + LIFT * radius * normal, outgoing)
    distance = np.linalg.norm(hits.position - position[hits.index], axis=1)
    free[hits.index] = np.minimum(free[hits.index], distance)
    return position + 0.5 * free[:, None] * outgoing


class SamplerBatches:
    r"""Directions towards the lamp, drawn by the luminance seen along them.

    That is the weight of the Kullback-Leibler divergence. With :math:`\Phi_p` the sum of a point's
    samples, points are drawn in proportion to :math:`\Phi_p / (\Phi_p + \bar\Phi)`: dim views count
    nearly as much as bright ones, but not more for what few samples have missed there. The usual
    sum :math:`\bar\Phi` is that of `Description.even_map`.
    """

    def __init__(self, samples: CapSamples, description: Description, device: torch.device) -> None:
        share = samples.luminance().astype(np.float64)
        total, usual = share.sum(1, keepdims=True), float(LUMINANCE @ description.even_map)
        cumulative = np.cumsum(share / (total + usual + 1e-300))
        self.point, self.square, self.cumulative = (
            torch.from_numpy(a).to(device) for a in (samples.point, samples.square, cumulative)
        )

    def draw(self, rng: np.random.Generator, size: int) -> tuple[Tensor, Tensor]:
        """Cap coordinates [size, 2] and shading points [size, 3]."""
        u = torch.from_numpy(rng.random(size)).to(self.cumulative.device) * self.cumulative[-1]
        index = torch.searchsorted(self.cumulative, u).clamp(max=len(self.cumulative) - 1)
        samples = self.square.shape[1]
        point, sample = index // samples, index % samples
        return self.square[point, sample], self.point[point]
