"""The reference picture of a luminaire, seen directly in front of a plain background."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence

import numpy as np

from purelight_format.camera import Camera
from purelight_format.errors import PureLightError, SpoiltWarning
from purelight_onnx.luminaire import Luminaire

RAYS = 1 << 16


def render(
    luminaire: Luminaire,
    camera: Camera,
    *,
    samples: int = 4,
    background: Sequence[float] = (0.0, 0.0, 0.0),
    seed: int = 0,
    progress: Callable[[int], object] = lambda rays: None,
) -> np.ndarray:
    """Averages `radiance + transmittance * background` over random rays in each pixel.

    Without a transparency network the luminaire is opaque. A ray whose answer is infinite or no
    number counts as dark, and a `SpoiltWarning` says how many there were.

    Arguments:
        background: [3] radiance behind the luminaire in W/(m² sr).
        progress: Called with the number of rays done since the last call.

    Returns:
        [size, size, 3] linear Rec.709 in W/(m² sr), rows from the top.

    Raises:
        PureLightError: If `samples` is below 1, or a network cannot be loaded.
    """
    if samples < 1:
        raise PureLightError(f"samples must be at least 1, not {samples}")
    behind = np.asarray(background, np.float64)
    rng = np.random.default_rng(seed)
    image, spoilt = np.zeros((camera.size**2, 3)), 0
    for _ in range(samples):
        for start in range(0, len(image), RAYS):
            pixel = np.arange(start, min(start + RAYS, len(image)))
            light = shade(luminaire, *camera.rays(pixel, rng), behind)
            good = np.isfinite(light).all(1)
            image[pixel[good]] += light[good]
            spoilt += len(pixel) - int(good.sum())
            progress(len(pixel))
    if spoilt:
        warnings.warn(SpoiltWarning(spoilt), stacklevel=2)
    return (image / samples).reshape(camera.size, camera.size, 3).astype(np.float32)


def shade(
    luminaire: Luminaire,
    origin: np.ndarray,
    direction: np.ndarray,
    background: np.ndarray,
) -> np.ndarray:
    """Radiance along rays [N, 3] against their direction: [N, 3] in W/(m² sr)."""
    result = np.tile(background, (len(origin), 1))
    hits = luminaire.exit_surface.intersect(origin, direction)
    query = hits.position, hits.normal, -direction[hits.ray]
    radiance = luminaire.radiance(*query)
    if luminaire.has("transparency"):
        radiance = radiance + luminaire.transmittance(*query) * background
    result[hits.ray] = radiance
    return result
