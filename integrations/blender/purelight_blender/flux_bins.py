"""Triangles in a few groups of like radiance, so that Cycles' light tree knows where the power is.

Cycles chooses a triangle of a lamp by its area times what its material says it emits. A material
can say one number, so triangles of like radiance share one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.color import LUMINANCE

MOST = 6  # Materials of a lamp: each is compiled by itself.
GOOD = 1.25  # Second moment of the choice over that of the best choice.
DARK = 1e-3  # Of all power: a bin with less is not aimed at.
FEW = 0.05  # Of all power: so much is aimed at like the rest.
DEPTH = 4.0**5  # Between the brightest bin and the darkest one.


@dataclass(frozen=True)
class Bins:
    """Groups of triangles.

    Arguments:
        of: [T] the bin of each triangle.
        strength: [B] what stands for the mean radiance of a bin in W/(m² sr); not zero.
        sides: [B] from where a bin is aimed at, in Cycles' words; NONE where there is no light.
    """

    of: np.ndarray
    strength: np.ndarray
    sides: tuple[str, ...] = ()


def bins(area: np.ndarray, flux: np.ndarray, both: np.ndarray) -> Bins:
    """The fewest bins that are good enough; those that shine to both sides apart.

    Arguments:
        area: [T] m².
        flux: [T, 3] W.
        both: [T] whether light leaves from either side.
    """
    power = flux.astype(np.float64) @ LUMINANCE
    radiance = power / np.maximum(np.pi * area, 1e-300)
    for count in range(1, MOST + 1):
        made = _divided(area, power, radiance, count)
        if moment(area, power, made) < GOOD:
            break
    few = min(power[both].sum(), power[~both].sum()) < FEW * power.sum()
    apart = np.full(len(both), both @ power > power.sum() / 2) if few else both
    used, of = np.unique(2 * made.of + apart, return_inverse=True)
    of, strength = of.reshape(-1), made.strength[used // 2]
    bright = np.bincount(of, power, len(used)) > DARK * power.sum()
    aims = ("FRONT_BACK" if two else "FRONT" for two in used % 2)
    sides = (aim if lit else "NONE" for aim, lit in zip(aims, bright, strict=True))
    return Bins(of, strength, tuple(sides))


def moment(area: np.ndarray, power: np.ndarray, made: Bins) -> float:
    """Second moment of power over the density of the choice, 1 where that is in proportion."""
    if not power.any():
        return 1.0
    weight = area * made.strength[made.of]
    density = weight / weight.sum()
    return float((power**2 / np.maximum(density, 1e-300)).sum() / power.sum() ** 2)


def _divided(area: np.ndarray, power: np.ndarray, radiance: np.ndarray, count: int) -> Bins:
    """Bins of equal width in log radiance, the last with all that is darker; empty ones go."""
    top = np.quantile(radiance[power > 0], 0.99) if (power > 0).any() else 1.0
    depth = min(DEPTH, 4.0**count)
    height = np.log(np.maximum(radiance, top / depth) / top) / np.log(depth)
    at = np.clip((-height * count).astype(int), 0, count - 1)
    used, of = np.unique(at, return_inverse=True)
    second = np.bincount(of, area * radiance**2, len(used))
    covered = np.bincount(of, area, len(used))
    mean = np.sqrt(second / np.maximum(covered, 1e-300))
    return Bins(of.reshape(-1), np.maximum(mean, top / DEPTH))
