"""A lamp's radiance as a function of places on its exit surface, and what viewers see of it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from purelight_format.camera import Camera
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]
Radiance = Callable[[Float, Float, Float], Float]  # position, normal, outgoing: three of [N, 3]
MARGIN = 1.05  # of training's pictures


def seen(
    surface: ExitSurface, radiance: Radiance, origin: Float, direction: Float
) -> tuple[Float, NDArray[np.bool_]]:
    """Radiance along rays, zero where they miss the lamp [N, 3], and whether they meet it [N]."""
    hits = surface.intersect(origin, direction)
    value, met = np.zeros((len(origin), 3), np.float32), np.zeros(len(origin), np.bool_)
    value[hits.index] = radiance(hits.position, hits.normal, -direction[hits.index])
    met[hits.index] = True
    return value, met


def look(surface: ExitSurface, radiance: Radiance, origin: Float, direction: Float) -> Float:
    """Radiance along rays, zero where they miss the lamp: [N, 3], [N, 3] -> [N, 3]."""
    return seen(surface, radiance, origin, direction)[0]


def portrait(
    surface: ExitSurface, radiance: Radiance, size: int, azimuth: float, elevation: float
) -> Float:
    """The lamp from outside, by one ray a pixel: [size, size, 3]; angles as in `orbit_axes`."""
    camera = Camera.orbit(
        surface.sphere, azimuth=azimuth, elevation=elevation, size=size, margin=MARGIN
    )
    origin, direction = (rays.astype(np.float32) for rays in camera.middle_rays())
    return look(surface, radiance, origin, direction).reshape(size, size, 3)
