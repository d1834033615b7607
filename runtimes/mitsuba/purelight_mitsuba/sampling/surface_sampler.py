"""Points of the lamps' exit surfaces, drawn for shading points near a lamp or inside its sphere.

A direction has the density of the point that it meets first (`spec/measures.md`, Eq. 8). A drawn
point that the lamp itself hides is thrown away, so a direction's density never has to sum over all
crossings of the ray: the light of a lamp is the integral over those points of its surface that are
seen, and this draws them and no others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE
from purelight_format.members.surface import Surface
from purelight_mitsuba.device_array import device_array

DEFENSIVE = 0.2  # Part of the points drawn by area, so that no triangle with radiance is missed.
SHELL = 1.25  # Radii from where on the sampler network alone aims at a lamp.
PACKETS = 3  # Of four floats per triangle.


@dataclass
class SurfacePoint:
    """A point drawn per lane, in the luminaire frame.

    Arguments:
        facet: Its triangle, counted within the lamp.
        normal: The triangle's unit normal.
    """

    position: mi.Point3f
    facet: mi.UInt32
    normal: mi.Normal3f


class SurfaceSampler:
    """Draws triangles by flux, mixed with area, and points evenly on them.

    Arguments:
        surfaces: The different exit surfaces, at least one.
    """

    def __init__(self, surfaces: Sequence[Surface]) -> None:
        counts = [len(surface.triangles) for surface in surfaces]
        first = np.cumsum([0, *counts[:-1]])
        chances = [probabilities(surface) for surface in surfaces]
        thresholds, aliases = zip(*map(alias_table, chances), strict=True)
        tables = [
            _table(surface, chance, threshold)
            for surface, chance, threshold in zip(surfaces, chances, thresholds, strict=True)
        ]
        self._triangles = device_array(mi.Float, np.concatenate(tables))
        self._aliases = device_array(mi.UInt32, np.concatenate(aliases))
        self._ranges = device_array(mi.UInt32, np.column_stack([first, counts]))

    def sample(
        self, surface: mi.UInt32, choice: mi.Point2f, u: mi.Point2f, active: mi.Bool
    ) -> SurfacePoint:
        """Draws points.

        Arguments:
            surface: Index of the exit surface.
            choice: Uniform numbers that pick the triangle.
            u: Uniform numbers that pick the point on it.
        """
        first, count = dr.gather(mi.Vector2u, self._ranges, surface, active)
        bucket = dr.minimum(mi.UInt32(choice.x * count), count - 1)
        threshold = self._packet(first + bucket, 0, active).w
        alias = dr.gather(mi.UInt32, self._aliases, first + bucket, active)
        facet = dr.select(choice.y < threshold, bucket, alias)
        corner, along, across = (self._packet(first + facet, k, active) for k in range(PACKETS))
        b = mi.warp.square_to_uniform_triangle(u)
        position = dr.fma(along.xyz, b.x, dr.fma(across.xyz, b.y, corner.xyz))
        normal = mi.Normal3f(dr.normalize(dr.cross(along.xyz, across.xyz)))
        return SurfacePoint(mi.Point3f(position), facet, normal)

    def pdf_solid_angle(
        self,
        surface: mi.UInt32,
        facet: mi.UInt32,
        normal: mi.Normal3f,
        toward: mi.Vector3f,
        active: mi.Bool,
    ) -> mi.Float:
        """The density of the direction to a point that is seen; either side of a facet counts.

        Arguments:
            surface: Index of the exit surface.
            facet: Triangle of the point.
            normal: Its unit normal.
            toward: From the shading point to it, not normalised, in the luminaire frame.
        """
        first = dr.gather(mi.Vector2u, self._ranges, surface, active).x
        pdf_area = self._packet(first + facet, 1, active).w
        square = dr.squared_norm(toward)
        cosine = dr.abs(dr.dot(normal, toward)) * dr.rsqrt(square)
        return dr.select(cosine > 0, pdf_area * square / cosine, 0)

    def _packet(self, triangle: mi.UInt32, packet: int, active: mi.Bool) -> mi.Vector4f:
        return dr.gather(mi.Vector4f, self._triangles, triangle * PACKETS + packet, active)


def share(radii: mi.Float) -> mi.Float:
    """How often points at a distance from a lamp's centre sample its exit surface.

    It is one inside the bounding sphere and falls smoothly to zero at `SHELL` radii, so that
    neither the noise nor the bias of the techniques on both sides has an edge.
    """
    t = dr.clip((SHELL - radii) / (SHELL - 1), 0, 1)
    return t * t * (3 - 2 * t)


def probabilities(surface: Surface) -> np.ndarray:
    """Chance of each triangle: [T] float64, zero where one has no area."""
    area = surface.area()
    flux = np.where(area > 0, surface.triangle_flux @ LUMINANCE, 0).astype(np.float64)
    parts = [part / part.sum() for part in (flux, area) if part.sum() > 0]
    if not parts:
        return np.full(len(area), 1 / len(area))
    weights = (1 - DEFENSIVE, DEFENSIVE) if len(parts) == 2 else (1.0,)
    return np.average(parts, axis=0, weights=weights)


def alias_table(probability: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vose's method: a bucket is kept below its threshold, and else replaced by its alias.

    Arguments:
        probability: [T], sums to one.

    Returns:
        Thresholds [T] and aliases [T].
    """
    threshold, alias = probability * len(probability), np.arange(len(probability))
    small, large = list(np.flatnonzero(threshold < 1)), list(np.flatnonzero(threshold >= 1))
    while small and large:
        low, high = small.pop(), large[-1]
        alias[low] = high
        threshold[high] -= 1 - threshold[low]
        if threshold[high] < 1:
            small.append(large.pop())
    threshold[small + large] = 1
    return threshold, alias


def _table(surface: Surface, probability: np.ndarray, threshold: np.ndarray) -> np.ndarray:
    """Corner and threshold, edge and area density, other edge: [T, PACKETS * 4]."""
    a, b, c = np.moveaxis(surface.positions.astype(np.float64)[surface.triangles], 1, 0)
    area = surface.area()
    pdf_area = np.divide(probability, area, out=np.zeros_like(area), where=area > 0)
    return np.column_stack([a, threshold, b - a, pdf_area, c - a, np.zeros(len(a))])
