"""Outlines of lenses that gather the light of a point at the origin into a beam along +Z."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def collimating_front(index: float, distance: float, reach: float, steps: int = 16) -> Floats:
    """A refracting surface around +Z that makes light parallel: [K, 2] of (r, z) from the axis.

    Equal optical paths from the origin to a plane give a hyperbola in polar form,
    rho = distance (n - 1) / (n cos(theta) - 1).

    Arguments:
        distance: of the surface on the axis.
        reach: largest r, below where the surface becomes parallel to the light.
    """
    angle = np.linspace(0, np.arctan2(reach, distance), 64 * steps)
    rho = distance * (index - 1) / (index * np.cos(angle) - 1)
    r = rho * np.sin(angle)
    z = rho * np.cos(angle)
    at = np.linspace(0, reach, steps)
    return np.stack((at, np.interp(at, r, z)), 1)


def reflecting_side(index: float, wall: float, foot: float, last: float, steps: int = 24) -> Floats:
    """A surface that reflects light totally along +Z: [K, 2] of (r, z) from its foot at z = 0.

    The light leaves the origin between the horizon and `last`, enters the lens through an upright
    wall of radius `wall`, where sin(t) = cos(theta) / n, and meets the surface, whose tangent
    halves the angle between it and +Z. The surface is followed from ray to ray.

    Arguments:
        foot: radius at which it begins.
        last: angle from +Z in radians up to which light comes.
    """
    elevation = np.linspace(0, 0.5 * np.pi - last, 32 * steps)
    inside = np.arcsin(np.sin(elevation) / index)
    entry = wall * np.tan(elevation)
    points = [np.array([foot, 0.0])]
    for slope, height in zip(np.tan(inside)[1:], entry[1:], strict=True):
        r, z = points[-1]
        steep = np.tan(0.5 * (np.arctan(slope) + 0.5 * np.pi))
        step = (height + slope * (r - wall) - z) / (steep - slope)
        points.append(np.array([r + step, z + step * steep]))
    path = np.array(points)
    even = np.linspace(0, len(path) - 1, steps).round().astype(int)
    return path[even]
