"""The flux that a radiance field sends out of its lamp, and how to make it the traced one."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from purelight_format.measures import flux_estimate
from purelight_train.learning.reference_rays import ReferenceRays
from purelight_train.light.direction_zones import zone_middles, zone_of
from purelight_train.light.radiance_field import Float, Radiance

PASS = 1 << 18
LIFT = 1e-4  # radii
BANDS, AROUND = 256, 64  # cells of directions, of equal solid angle
USUAL_TILT = 0.1  # of a coefficient; more has to be shown by many records
NEAR = 1e-9  # of moments
MOST = 1.0  # of the logarithm of a tilt
Visitor = Callable[[Float, NDArray[np.float64]], None]
Progress = Callable[[float], None]


def escaping_flux(
    references: ReferenceRays,
    radiance: Radiance,
    rng: np.random.Generator,
    *,
    precision: float = 1.5e-3,
    most: int = 1 << 24,
    visit: Visitor = lambda direction, power: None,
    progress: Progress = lambda _: None,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    r"""Flux of the rays that leave the surface and do not meet it again.

    .. math:: \Phi = \pi A\,E_q[f V / \rho]

    over reference rays, with V one if the ray escapes: light that would meet the lamp again is left
    out.

    Arguments:
        precision: relative standard error to reach in every channel; rays are added until then.
        most: rays at most.
        visit: called with the directions [N, 3] and powers [N, 3] of each pass of `PASS` rays,
            whose mean over all passes is the flux in W.
        progress: called with the part of the work that is done, as far as is known by then.

    Returns:
        flux and standard error in W per channel, each [3].
    """
    first, second, count = np.zeros(3), np.zeros(3), 0
    while count < most:
        _, outgoing, value = escaping_rays(references, radiance, PASS, rng)
        visit(outgoing, value)
        first, second, count = first + value.sum(0), second + (value**2).sum(0), count + PASS
        mean = first / count
        error = np.sqrt(np.maximum(second / count - mean**2, 0) / count)
        done = _part_known(mean, error, precision)
        progress(max(done, count / most))
        if done == 1:
            break
    return mean, error


def _part_known(mean: NDArray[np.float64], error: NDArray[np.float64], precision: float) -> float:
    """Rays so far over those that a precision takes, 0 to 1: errors fall by their root."""
    allowed = precision * mean
    if (error <= allowed).all():
        return 1.0
    far = error > allowed
    return float(((allowed[far] / error[far]) ** 2).min())


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
    value[surface.blocked(lifted, outgoing)] = 0
    return position, outgoing, value


class DirectionalLight:
    """Light by cell of its direction, and which way it goes there.

    A beam along the poles lies at the edge of its cells: their middles are degrees off.

    Attributes:
        power: [BANDS * AROUND, 3].
    """

    def __init__(self) -> None:
        self.power = np.zeros((BANDS * AROUND, 3))
        self._way = np.zeros((BANDS * AROUND, 3))

    def add(self, direction: Float, power: NDArray[np.floating]) -> None:
        """Rays [N, 3] of so much power [N, 3]."""
        self.power += by_direction(direction, power)
        self._way += by_direction(direction, direction * power.sum(1, keepdims=True))

    def toward(self) -> NDArray[np.float32]:
        """The mean direction of the light of each cell; its middle where there is none: [K, 3]."""
        length = np.linalg.norm(self._way, axis=1, keepdims=True)
        known = length > 0
        mean = np.where(known, self._way / np.where(known, length, 1), zone_middles(BANDS, AROUND))
        return mean.astype(np.float32)


def by_direction(direction: Float, power: NDArray[np.floating]) -> NDArray[np.float64]:
    """Power by cell of its direction: [N, 3], [N, C] -> [BANDS * AROUND, C]."""
    cell, cells = zone_of(direction, BANDS, AROUND), BANDS * AROUND
    return np.stack([np.bincount(cell, column, cells) for column in power.T], 1)


def cell_directions() -> NDArray[np.float32]:
    """The middle of each cell: [BANDS * AROUND, 3]."""
    return zone_middles(BANDS, AROUND).astype(np.float32)


def moments_of(
    harmonics: Callable[[slice], NDArray[np.float64]], power: NDArray[np.floating]
) -> NDArray[np.float64]:
    """Mean of harmonics over light, by channel: [C, H].

    Arguments:
        harmonics: of some of the light at a time, [K, H]: of all of it they would be gigabytes.
        power: [N, C] in W.
    """
    sums: Any = 0.0
    for first in range(0, len(power), PASS):
        part = slice(first, first + PASS)
        sums = sums + power[part].T.astype(np.float64) @ harmonics(part)
    mean: NDArray[np.float64] = sums / np.maximum(power.sum(0, dtype=np.float64), 1e-300)[:, None]
    return mean


def effective_size(weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Effective sample size of weighted records (Kish 1965), by channel: [N, C] -> [C]."""
    count: NDArray[np.float64] = weight.sum(0) ** 2 / np.maximum((weight**2).sum(0), 1e-300)
    return count


def bounded(
    t: NDArray[np.float64], told: NDArray[np.float64], harmonics: NDArray[np.float64],
    everywhere: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    r"""A tilt that changes light by at most :math:`e^{\pm MOST}` in any direction.

    Beyond a beam harmonics may say anything: a thousandth of haze there can ask for any tilt. What
    told light sums to stays.

    Arguments:
        t: [H], the first coefficient is that of the constant.
        told: [K], light by direction; `harmonics` there, [K, H], and `everywhere`, [M, H].
    """
    t = t.copy()
    largest = np.abs(everywhere[:, 1:] @ t[1:]).max()
    t[1:] *= min(1.0, MOST / max(largest, 1e-300))
    p = told / max(told.sum(), 1e-300)
    sum_of_tilted = float((p * np.exp(harmonics[:, 1:] @ t[1:])).sum())
    t[0] = -math.log(sum_of_tilted) / harmonics[0, 0] if sum_of_tilted > 0 else 0.0
    return t


def tilt(
    told: NDArray[np.float64],
    harmonics: NDArray[np.float64],
    moments: NDArray[np.float64],
    records: float,
) -> NDArray[np.float64]:
    r"""What told light is to be multiplied by so that its moments are those of traced light.

    The most likely t of :math:`\exp(t \cdot Y(\omega))` given the traced light, with a normal
    prior: exponential tilting. At its maximum the harmonics' means over both are equal. The sum
    of the light stays.

    Arguments:
        told: [K], light by direction.
        harmonics: [K, H], Y there; the first is constant.
        moments: [H], mean of Y over the traced light (`moments_of`).
        records: how many of equal power would know the traced light as well.

    Returns:
        t, [H]; zero if there is no light.
    """
    if not (told.sum() > 0 and records > 0):
        return np.zeros(harmonics.shape[1])
    p = told / told.sum()
    prior = np.full(harmonics.shape[1], 1 / (USUAL_TILT**2 * records))
    prior[0] = 0.0  # the flux is known

    def loss(t: NDArray[np.float64]) -> float:
        return float((p * np.exp(harmonics @ t)).sum() - moments @ t + 0.5 * (prior * t**2).sum())

    def slope(t: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(harmonics.T @ (p * np.exp(harmonics @ t)) - moments + prior * t)

    def bend(t: NDArray[np.float64]) -> NDArray[np.float64]:
        weight = p * np.exp(harmonics @ t)
        return np.asarray((harmonics * weight[:, None]).T @ harmonics + np.diag(prior))

    exact = {"gtol": NEAR}
    found = minimize(
        loss, 0 * moments, jac=slope, hess=bend, method="trust-exact", options=exact
    )  # fmt: skip
    return np.asarray(found.x, np.float64)
