"""Candidates for vectors: points, squares and transforms, and the bugs that they hunt."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from purelight_format.measures import BoundingSphere, frame

Arrays = dict[str, np.ndarray]
Flags = dict[str, np.ndarray]  # [M] whether a candidate hunts the bug.

ALL = np.array(True)


@dataclass(frozen=True)
class Wish:
    """Candidates for a set, the most wanted first.

    Arguments:
        inputs: [M, ...].
        flags: by bug, which candidates hunt it.
        keep: [M] which candidates may be used.
        count: how many to take.
    """

    inputs: Arrays
    flags: Flags
    keep: np.ndarray | None = None
    count: int = 64

    @property
    def float32(self) -> Arrays:
        return {name: np.asarray(array, np.float32) for name, array in self.inputs.items()}


def directions(count: int, rng: np.random.Generator) -> np.ndarray:
    direction = rng.standard_normal((count, 3))
    return direction / np.linalg.norm(direction, axis=1, keepdims=True)


def squares(count: int, rng: np.random.Generator) -> np.ndarray:
    """Uniform points of the square, its edges and diagonals first."""
    low, high = 0.0, 1 - 2**-24
    edges = [(low, low), (high, high), (low, high), (0.5, 0.5), (0.5, low), (0.25, 0.25),
             (0.75, 0.25), (0.3, high), (low, 0.7), (0.125, 0.875), (0.5, 0.75)]  # fmt: skip
    u = rng.random((count, 2))
    u[: len(edges)] = edges
    return u


def u_edge(u: np.ndarray) -> np.ndarray:
    return ((u == 0) | (u >= 1 - 2**-24)).any(1)


def point_flags(point: np.ndarray, sphere: BoundingSphere) -> Flags:
    """The hard cases of shading points."""
    offset = point.astype(np.float64) - sphere.center
    radii = np.linalg.norm(offset, axis=1) / sphere.radius
    return {
        "CENTRE": radii == 0,
        "INSIDE": (radii > 0) & (radii < 0.999),
        "ON_SPHERE": np.abs(radii - 1) < 0.001,
        "CANCELLATION": radii > 100,
        "FAR": radii > 9e4,
    }


def cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return (a * b).sum(1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)


def placed(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def ball(sphere: BoundingSphere) -> np.ndarray:
    """The transform that makes the unit sphere this one: [4, 4]."""
    matrix = np.diag([sphere.radius] * 3 + [1.0])
    matrix[:3, 3] = sphere.center
    return matrix


def placed_flags(matrix: np.ndarray) -> Flags:
    scale = np.cbrt(np.linalg.det(matrix[:3, :3]))
    turned = np.abs(matrix[:3, :3] / scale - np.eye(3)).max() > 0.1
    flags = {"DIMMER": True, "ROTATION": turned, "SCALE": abs(scale - 1) > 0.1}
    return {flag: ALL for flag, hunted in flags.items() if hunted}


def transform(
    axis: tuple[float, float, float], degrees: float, scale: float, shift: tuple[float, ...]
) -> np.ndarray:
    """A rotation about a unit axis, a scale and a translation, row-major [4, 4]."""
    angle = math.radians(degrees)
    tangent, bitangent = (v[0] for v in frame(np.array([axis])))
    basis = np.stack((tangent, bitangent, axis), 1)
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = scale * basis @ turn @ basis.T, shift
    return matrix


TRANSFORMS = {
    "turned": np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]]),
    "scaled": transform((0.48, 0.6, 0.64), 50.0, 2.5, (1.0, -2.0, 0.5)),
    "small": transform((-0.6, 0.0, 0.8), 110.0, 1e-3, (0.01, 0.02, -0.005)),
    "large": transform((0.0, 1.0, 0.0), -70.0, 1e3, (-300.0, 100.0, 50.0)),
    "rounded": np.round(transform((0.36, -0.48, 0.8), 200.0, 1.7, (0.4, 0.0, -1.0)), 5),
}
REFUSED = {
    "mirror": np.diag([1.0, -1.0, 1.0, 1.0]),
    "uneven": np.diag([1.0, 1.0, 1.1, 1.0]),
    "shear": np.array([[1, 0.1, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]),
    "hardly-uneven": np.diag([1.0, 1.0, 1.001, 1.0]),
    "hardly-sheared": np.array([[1, 0.001, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]),
    "flat": np.diag([1.0, 1.0, 0.0, 1.0]),
    "projective": np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0.1, 1.0]]),
}
