"""Light that a luminaire brings to points of the room, by sampling its networks.

One sample is an estimate whose mean is the irradiance: `by_sampler` (the mode `accurate`), `by_map`
(`fast`) and, for points on or inside the bounding sphere, `by_surface`. All is in the luminaire
frame; equation numbers refer to spec/measures.md.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from purelight_format.color import LUMINANCE
from purelight_format.errors import PureLightError
from purelight_format.measures import (
    OUTSIDE,
    area_to_solid_angle,
    cap,
    draw_from_map,
    light_estimate,
)
from purelight_onnx.luminaire import UNIT_TOLERANCE, Luminaire

BY_AREA = 0.2  # Part of the points drawn by area, so that no triangle with radiance is missed.
CHUNK = 1 << 12

Estimator = Callable[[Luminaire, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def irradiance(
    luminaire: Luminaire,
    point: ArrayLike,
    normal: ArrayLike,
    *,
    samples: int = 4096,
    mode: str = "accurate",
    seed: int = 0,
) -> np.ndarray:
    """Irradiance of small surfaces in the light of the luminaire alone.

    Arguments:
        luminaire: an open luminaire.
        point: [N, 3] or [3] in metres.
        normal: [N, 3] or [3] unit normals of the surfaces.
        samples: directions at each point; the error falls with their square root.
        mode: `accurate` (sampler and appearance) or `fast` (radiance map), outside of the bounding
            sphere; on and inside it, the exit surface is sampled in either mode.

    Returns:
        [N, 3] or [3] in W/m² per linear Rec.709 channel.

    Raises:
        PureLightError: The bundle lacks a network, or an argument has another shape, is not
            finite, or is a normal of another length than 1.
    """
    if mode not in ("accurate", "fast"):
        raise PureLightError(f"mode {mode} is neither accurate nor fast")
    if samples < 1:
        raise PureLightError(f"samples must be at least 1, not {samples}")
    points, normals = (np.atleast_2d(np.asarray(v, np.float64)) for v in (point, normal))
    if points.shape != normals.shape or points.shape[1:] != (3,):
        raise PureLightError(
            f"point and normal must both be [N, 3], not {points.shape} and {normals.shape}"
        )
    if not np.isfinite(points).all():
        raise PureLightError("point must be finite")
    if not (np.abs(np.linalg.norm(normals, axis=1) - 1) <= UNIT_TOLERANCE).all():
        raise PureLightError("normal must have unit length")
    rng, light = np.random.default_rng(seed), np.empty_like(points)
    outside = _outside(luminaire, points)
    for row in range(len(points)):
        far: Estimator = by_map if mode == "fast" else by_sampler
        estimator = far if outside[row] else by_surface
        light[row] = _mean(estimator, luminaire, points[row], normals[row], samples, rng)
    return light if np.ndim(point) == 2 else light[0]


def _mean(
    estimator: Estimator,
    luminaire: Luminaire,
    point: np.ndarray,
    normal: np.ndarray,
    samples: int,
    rng: np.random.Generator,
) -> np.ndarray:
    total = np.zeros(3)
    for first in range(0, samples, CHUNK):
        count = min(CHUNK, samples - first)
        shape = np.broadcast_to(point, (count, 3)), np.broadcast_to(normal, (count, 3))
        total += estimator(luminaire, *shape, rng.random((count, 2))).sum(0)
    return total / samples


def by_sampler(
    luminaire: Luminaire, point: np.ndarray, normal: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """One sample each of Eq. 10 with f = 1: the sampler's direction, the radiance met along it.

    Arguments:
        point, normal: [N, 3].
        u: [N, 2] uniform in [0, 1).

    Returns:
        [N, 3] in W/m²; zero at points on or inside the bounding sphere.
    """
    toward, pdf = luminaire.sample(point, u)
    hits = luminaire.exit_surface.intersect(point, toward.astype(np.float64))
    radiance = np.zeros((len(point), 3))
    radiance[hits.ray] = luminaire.radiance(hits.position, hits.normal, -toward[hits.ray])
    return light_estimate(radiance, (toward * normal).sum(1), pdf)


def by_map(
    luminaire: Luminaire, point: np.ndarray, normal: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """One sample each of Eq. 13: a cell of the map by its luminance, a direction evenly inside it.

    Arguments and result are those of `by_sampler`.
    """
    view = cap(np.asarray(point, np.float64), luminaire.manifest.bounding_sphere)
    cells = luminaire.radiance_map(point).astype(np.float64)
    radiance, toward, pdf = draw_from_map(cells, u, view)
    return light_estimate(radiance, (toward * normal).sum(1), pdf)


def by_surface(
    luminaire: Luminaire, point: np.ndarray, normal: np.ndarray, u: np.ndarray
) -> np.ndarray:
    """One sample each of a point of the exit surface, by flux and area, converted by Eq. 8.

    Light of points that the luminaire itself hides does not count. Arguments and result are those
    of `by_sampler`, but the points may lie anywhere.
    """
    surface = luminaire.exit_surface
    chance = chances(luminaire)
    if not chance.any():
        return np.zeros((len(point), 3))
    reached = np.cumsum(chance)
    triangle = np.minimum(np.searchsorted(reached, u[:, 0] * reached[-1], "right"), len(chance) - 1)
    rest = (u[:, 0] * reached[-1] - reached[triangle] + chance[triangle]) / chance[triangle]
    offset = surface.point(triangle, np.stack((np.clip(rest, 0, 1), u[:, 1]), 1)) - point
    distance = np.linalg.norm(offset, axis=1)
    toward = offset / np.where(distance > 0, distance, 1)[:, None]
    hits = surface.intersect(point, toward)
    seen = hits.triangle == triangle[hits.ray]
    ray, position, facing = hits.ray[seen], hits.position[seen], hits.normal[seen]
    pdf_area = chance[triangle[ray]] / surface.area[triangle[ray]]
    pdf = area_to_solid_angle(pdf_area, point[ray], position, facing)
    radiance = luminaire.radiance(position, facing, -toward[ray])
    estimate = np.zeros((len(point), 3))
    estimate[ray] = light_estimate(radiance, (toward[ray] * normal[ray]).sum(1), pdf)
    return estimate


def chances(luminaire: Luminaire) -> np.ndarray:
    """Chance of each triangle of the exit surface: [T], zero where one has no area, as all may."""
    area = luminaire.exit_surface.area
    flux = np.where(area > 0, luminaire.bundle.surface().triangle_flux @ LUMINANCE, 0)
    parts = [part / part.sum() for part in (flux, area) if part.sum() > 0]
    if len(parts) == 2:
        return (1 - BY_AREA) * parts[0] + BY_AREA * parts[1]
    return parts[0] if parts else np.zeros(len(area))


def _outside(luminaire: Luminaire, point: np.ndarray) -> np.ndarray:
    sphere = luminaire.manifest.bounding_sphere
    return np.linalg.norm(point - sphere.center, axis=1) > sphere.radius * OUTSIDE
