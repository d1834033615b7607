"""The flux that a radiance field sends out of its lamp."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import flux_estimate
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.radiance_field import Float, Radiance

PASS = 1 << 18
LIFT = 1e-4  # radii


def escaping_flux(
    references: ReferenceRays,
    radiance: Radiance,
    rng: np.random.Generator,
    *,
    precision: float = 1.5e-3,
    most: int = 1 << 22,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    r"""Flux of the rays that leave the surface and do not meet it again.

    .. math:: \Phi = \pi A\,E_q[f V / \rho]

    over reference rays, with V one if the ray escapes: light that would meet the lamp again is left
    out.

    Arguments:
        precision: relative standard error to reach in every channel; rays are added until then.
        most: rays at most.

    Returns:
        flux and standard error in W per channel, each [3].
    """
    first, second, count = np.zeros(3), np.zeros(3), 0
    while count < most:
        _, _, value = escaping_rays(references, radiance, PASS, rng)
        first, second, count = first + value.sum(0), second + (value**2).sum(0), count + PASS
        mean = first / count
        error = np.sqrt(np.maximum(second / count - mean**2, 0) / count)
        if (error <= precision * mean).all():
            break
    return mean, error


def escaping_rays(
    references: ReferenceRays, radiance: Radiance, count: int, rng: np.random.Generator
) -> tuple[Float, Float, NDArray[np.float64]]:
    """Rays that leave the surface, and the power of each: the mean over all is the flux.

    Returns:
        position, outgoing direction, and power in W per channel, three of [count, 3]; those that
        meet the lamp again have no power.
    """
    surface = references.chart.surface
    position, normal, outgoing, log_ratio = references.sample(count, rng)
    pdf_projected = np.exp(log_ratio.astype(np.float64)) / math.pi
    value = flux_estimate(radiance(position, normal, outgoing), 1 / surface.area, pdf_projected)
    lifted = position + LIFT * surface.sphere.radius * normal
    value[surface.intersect(lifted, outgoing).index] = 0
    return position, outgoing, value
