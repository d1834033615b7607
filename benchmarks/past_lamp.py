"""Pixels that see past a lamp: what a light tracer, too, can draw of a room."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.measures import BoundingSphere

CLEAR = 1.1  # radii of the lamp's sphere that no such pixel's ray meets


def past_lamp(sensor: Any, sphere: BoundingSphere, clear: float = CLEAR) -> NDArray[np.bool_]:
    """Pixels whose middle rays pass a lamp's sphere by a tenth of its radius: [H, W].

    Arguments:
        clear: radii from the sphere's middle that they pass, if others.
    """
    import mitsuba as mi

    width, height = (int(n) for n in sensor.film().size())
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).reshape(-1, 2) + 0.5
    at = mi.Point2f(np.ascontiguousarray((grid / (width, height)).T, np.float32))
    ray, _ = sensor.sample_ray(0, 0.5, at, 0.5)
    origin, direction = (np.array(v, np.float64).T for v in (ray.o, ray.d))
    toward = np.asarray(sphere.center) - origin
    along = (toward * direction).sum(1, keepdims=True)
    off = np.linalg.norm(toward - along * direction, axis=1)
    found: NDArray[np.bool_] = (off > clear * sphere.radius).reshape(height, width)
    return found
