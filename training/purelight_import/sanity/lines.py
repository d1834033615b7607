"""Straight lines through a lamp: which surfaces each crosses, in order, and from which side."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_import.sanity.subject import Subject, lifted

LINES, CROSSINGS = 1 << 14, 96


@dataclass(frozen=True)
class Crossings:
    """All crossings of lines, line by line and in order.

    Arguments:
        line, shape: [C] numbers.
        enters: [C] whether the surface's front was met.
        distance: [C] from the line's origin.
    """

    line: NDArray[np.int64]
    shape: NDArray[np.int64]
    enters: NDArray[np.bool_]
    distance: NDArray[np.float64]


def crossings(subject: Subject, seed: int = 0) -> Crossings:
    """Crossings of even lines through the sphere around a scene."""
    origin, direction = _lines(subject, np.random.default_rng(seed))
    ray = mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(direction.T))
    active, found = mi.Bool(np.ones(LINES, bool)), []
    for _ in range(CROSSINGS):
        si = subject.scene.ray_intersect(ray, +mi.RayFlags.Minimal, coherent=False, active=active)
        active = active & si.is_valid()
        ray = lifted(si.p, si.n, ray.d, subject.extent)
        dr.eval(si, ray, active)
        met = np.flatnonzero(np.array(active))
        if not len(met):
            break
        place = np.array(si.p).T[met]
        facing = np.einsum("nd,nd->n", np.array(si.n).T[met], direction[met])
        far = np.einsum("nd,nd->n", place - origin[met], direction[met].astype(np.float64))
        found.append((met, subject.numbers(si.shape)[met], facing < 0, far))
    if not found:
        return Crossings(*(np.zeros(0, t) for t in (np.int64, np.int64, bool, np.float64)))
    line, shape, enters, distance = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(line, kind="stable")
    return Crossings(line[order], shape[order], enters[order], distance[order])


def _lines(
    subject: Subject, rng: np.random.Generator
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Origins outside of the scene and unit directions, [N, 3]: lines even through the sphere."""
    direction = rng.normal(size=(LINES, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    across = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction), 1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    angle, reach = 2 * np.pi * rng.random((LINES, 1)), np.sqrt(rng.random((LINES, 1)))
    offset = reach * (np.cos(angle) * across + np.sin(angle) * np.cross(direction, across))
    centre = subject.bounds.mean(0)
    origin = centre + subject.radius * (offset - 1.05 * direction)
    return origin.astype(np.float32), direction.astype(np.float32)
