"""Inputs on which networks are checked: random ones, and the hard cases first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.measures import BoundingSphere, cap, cap_to_direction, frame

Arrays = dict[str, np.ndarray]

EDGE_RADII = (0.0, 0.5, 1 - 1e-5, 1 + 1e-4, 1.001, 1.1, 2.0, 14.9, 20.0, 1e3, 1e6)
EDGE_UNIFORMS = ((0.0, 0.0), (1 - 2**-24, 1 - 2**-24), (0.5, 0.5), (0.02, 0.3), (0.3, 1 - 2**-24))


@dataclass(frozen=True)
class Extent:
    """Where a lamp is, and as far as which its networks know it.

    Arguments:
        positions: [V, 3] of its exit surface, in metres.
        triangles: [T, 3].
        sphere: the bounding sphere.
        r_max: in radii.
    """

    positions: np.ndarray
    triangles: np.ndarray
    sphere: BoundingSphere
    r_max: float


def surface_probes(lamp: Extent, count: int, rng: np.random.Generator) -> Arrays:
    """Points on the exit surface with directions by cosine, every eighth one grazing."""
    corner = lamp.positions.astype(np.float64)[lamp.triangles]
    cross = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(cross, axis=1)
    chosen = rng.choice(len(area), count, p=area / area.sum())
    root, v = np.sqrt(rng.random(count)), rng.random(count)
    weight = np.stack([1 - root, root * (1 - v), root * v], 1)
    normal = cross[chosen] / area[chosen, None] * np.where(rng.random((count, 1)) < 0.5, -1, 1)
    radius, phi = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    radius[::8] = 1 - 1e-6
    tangent, bitangent = frame(normal)
    x, y = (radius * f(phi) for f in (np.cos, np.sin))
    outgoing = x[:, None] * tangent + y[:, None] * bitangent
    outgoing += np.sqrt(1 - radius**2)[:, None] * normal
    position = np.einsum("nk,nkd->nd", weight, corner[chosen])
    return _float32({"position": position, "normal": normal, "outgoing": outgoing})


def points(
    sphere: BoundingSphere, r_max: float, count: int, rng: np.random.Generator
) -> np.ndarray:
    """Shading points [count, 3]: the edge radii, then log-uniform from the sphere to 2 r_max."""
    radius = np.exp(rng.uniform(np.log(1.001), np.log(2 * r_max), count))
    radius[: len(EDGE_RADII)] = EDGE_RADII
    direction = rng.standard_normal((count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    offset = sphere.radius * radius[:, None] * direction
    return (np.array(sphere.center) + offset).astype(np.float32)


def point_probes(lamp: Extent, count: int, rng: np.random.Generator) -> Arrays:
    """Points alone."""
    return {"point": points(lamp.sphere, lamp.r_max, count, rng)}


def sampler_probes(lamp: Extent, count: int, rng: np.random.Generator) -> Arrays:
    """Points and uniforms, edges of one with ordinary values of the other."""
    u = rng.random((count, 2))
    start = len(EDGE_RADII)
    u[start : start + len(EDGE_UNIFORMS)] = EDGE_UNIFORMS
    return _float32({**point_probes(lamp, count, rng), "u": u})


def pdf_probes(lamp: Extent, count: int, rng: np.random.Generator) -> Arrays:
    """Points and directions in the cap, every eighth one beside it."""
    point = points(lamp.sphere, lamp.r_max, count, rng)
    view = cap(point.astype(np.float64), lamp.sphere)
    toward = cap_to_direction(rng.uniform(0.02, 0.98, (count, 2)), view)
    toward[::8] = -toward[::8]
    return _float32({"point": point, "toward": toward})


def _float32(arrays: Arrays) -> Arrays:
    return {name: array.astype(np.float32) for name, array in arrays.items()}
