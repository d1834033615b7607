"""Places inside a lamp's bounding sphere that room geometry may take up: outside all bodies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.zoo.figures.scenes import noise
from purelight_format.measures import BoundingSphere
from purelight_train.truth.picture import Picture

HALF = 0.08  # half the side of a patch, in radii
RAYS = 1 << 11
OPEN = 0.05  # part of a place's directions that must lead out of the lamp
LEAST_SEEN = 0.02  # part that must meet it
TRIALS = 400
KNOWN = 0.05  # noise of a place that says something
Vector = NDArray[np.float64]
Result = dict[str, float]


@dataclass(frozen=True)
class Place:
    """A patch: its middle, the normal of the side that is measured, and half its side in metres."""

    at: Vector
    normal: Vector
    half: float


def places(lamp: dict[str, Any], sphere: BoundingSphere) -> Iterator[Place]:
    """Patches that face what they see of the lamp.

    A place counts as outside if some directions lead away from the lamp, which they do not from
    within glass or a closed globe. There may be few or none: a ball leaves no room in its sphere.
    """
    scene = mi.load_dict({"type": "scene", **lamp})
    rng = np.random.default_rng(8)
    half = HALF * sphere.radius
    for _ in range(TRIALS):
        at = np.asarray(sphere.center) + sphere.radius * _in_ball(rng)
        direction = _unit(rng.normal(size=(RAYS, 3)))
        ray = mi.Ray3f(mi.Point3f(*at.tolist()), mi.Vector3f(direction.T.astype(np.float32)))
        distance = np.array(scene.ray_intersect_preliminary(ray).t, np.float64)
        seen = np.isfinite(distance)
        if LEAST_SEEN < seen.mean() < 1 - OPEN and distance.min() > 1.7 * half:
            normal = direction[seen].mean(0)
            if np.linalg.norm(normal) > 1e-3:
                yield Place(at, _unit(normal[None])[0], half)


def compared(told: Picture, true: Picture, place: Place, sphere: BoundingSphere) -> Result:
    """Mean irradiance of a place, ours over the truth less one, the noise of that, and where."""
    level = float(true.image.mean())
    mean = float(told.image.mean()) / level
    away = np.linalg.norm(place.at - np.asarray(sphere.center))
    return {
        "mean": mean - 1,
        "noise": float(np.hypot(mean * noise(told), noise(true))),
        "truth": level,
        "radii": float(away / sphere.radius),
    }


def summary(results: list[Result], dark: int) -> dict[str, Any]:
    """Over the places that are known well enough: the bias of their sum, and absolute errors.

    Arguments:
        dark: how many places besides were left out, because no light was found there.
    """
    known = [r for r in results if r["noise"] < KNOWN]
    figures: dict[str, Any] = {"dark": dark, "known": len(known), "each": results}
    if known:
        error = np.array([r["mean"] for r in known])
        truth = np.array([r["truth"] for r in known])
        figures |= {
            "mean": float((error * truth).sum() / truth.sum()),
            "absolute": float(np.abs(error).mean()),
            "worst": float(np.abs(error).max()),
            "noise": float(np.mean([r["noise"] for r in known])),
        }
    return figures


def _in_ball(rng: np.random.Generator) -> Vector:
    direction = _unit(rng.normal(size=(1, 3)))[0]
    return direction * rng.random() ** (1 / 3)


def _unit(vectors: Vector) -> Vector:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
