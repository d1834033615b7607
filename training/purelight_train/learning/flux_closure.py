"""Integrals of a radiance field over the exit surface and the hemispheres above it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from purelight_train.learning.cap_samples import Radiance
from purelight_train.light.exit_surface import ExitSurface


def surface_flux(
    surface: ExitSurface, radiance: Radiance, samples: int, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    r"""Flux :math:`\int\int L \cos\theta\,d\omega\,dA` of what leaves the lamp, and its error.

    Points are uniform by area and directions by cosine, so the estimate is pi A mean(L). Pairs
    from which light would meet the lamp again are not part of the exit surface and count zero.

    Returns:
        flux and standard error in W per channel, each [3].
    """
    position, normal = surface.sample(samples, rng)
    outgoing = cosine_directions(normal, rng)
    reach = 3 * surface.sphere.radius
    hits = surface.intersect(position + reach * outgoing, -outgoing)
    distance = np.linalg.norm(hits.position - position[hits.index], axis=1)
    seen = distance < 1e-4 * surface.sphere.radius
    value = np.zeros((samples, 3))
    index = hits.index[seen]
    value[index] = radiance(hits.position[seen], hits.normal[seen], outgoing[index])
    scale = math.pi * surface.area
    return scale * value.mean(0), scale * value.std(0) / math.sqrt(samples)


def cosine_directions(normal: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
    """Unit directions about normals [N, 3] with pdf cos(theta)/pi per solid angle: [N, 3]."""
    direction = rng.normal(size=normal.shape)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    direction += normal * 1.000001
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction.astype(np.float32)
