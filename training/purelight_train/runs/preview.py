"""Small pictures of what a network has learned."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from purelight_format import atomic
from purelight_format.measures import BoundingSphere
from purelight_train.learning.cap_samples import Radiance, look
from purelight_train.light.exit_surface import ExitSurface

Float = NDArray[np.float32]


def view_axes(
    azimuth: float, elevation: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Unit vectors [3] to the right and up in a view, and from the lamp to the camera."""
    a, e = np.radians((azimuth, elevation))
    back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(back, right), back


def view_half(distance: float) -> float:
    """Tangent of half the angle of view that frames a sphere `distance` radii away."""
    return 1.05 / math.sqrt(distance**2 - 1)


def view_rays(
    sphere: BoundingSphere, size: int, azimuth: float, elevation: float, distance: float = 4.0
) -> tuple[Float, Float]:
    """Rays of a pinhole camera that frames the sphere: origins and directions [size², 3].

    Arguments:
        azimuth, elevation: of the camera as seen from the lamp, in degrees.
        distance: from the centre, in radii.
    """
    right, up, back = view_axes(azimuth, elevation)
    half = view_half(distance)
    s = ((np.arange(size) + 0.5) / size * 2 - 1) * half
    x, y = np.meshgrid(s, -s)
    direction = x[..., None] * right + y[..., None] * up - back
    direction /= np.linalg.norm(direction, axis=-1, keepdims=True)
    origin = np.asarray(sphere.center) + distance * sphere.radius * back
    flat = direction.reshape(-1, 3).astype(np.float32)
    return np.broadcast_to(origin.astype(np.float32), flat.shape).copy(), flat


def view(
    surface: ExitSurface, radiance: Radiance, size: int, azimuth: float, elevation: float
) -> Float:
    """Picture of the lamp itself: [size, size, 3] radiance."""
    origin, direction = view_rays(surface.sphere, size, azimuth, elevation)
    return look(surface, radiance, origin, direction).reshape(size, size, 3)


def tone_map(radiance: Float, white: float) -> NDArray[np.uint8]:
    """sRGB bytes, with `white` shown as the brightest value."""
    x = np.clip(radiance / white, 0, 1)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return (srgb * 255 + 0.5).astype(np.uint8)


def save_png(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write a PNG crash-safely."""
    buffer = io.BytesIO()
    Image.fromarray(pixels).save(buffer, "PNG")
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(path, buffer.getvalue())


def save_row(path: Path, pictures: list[Float]) -> None:
    """Pictures side by side under one exposure, the 99.5th percentile of the first."""
    white = float(np.percentile(pictures[0].max(-1), 99.5)) or 1.0
    save_png(path, np.concatenate([tone_map(p, white) for p in pictures], axis=1))
