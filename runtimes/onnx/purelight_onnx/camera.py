"""A camera that looks at the luminaire: a pinhole, or a thin lens focused on its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere

MARGIN = 1.08


@dataclass(frozen=True)
class Camera:
    """A view of `target` from `origin`.

    Arguments:
        origin: Where the camera is, in metres.
        target: The point in the middle of the picture and in focus.
        half_width: Tangent of half the field of view.
        size: Pixels along each side.
        lens_radius: Radius of the lens in metres; zero is a pinhole.
    """

    origin: np.ndarray
    target: np.ndarray
    half_width: float
    size: int
    lens_radius: float = 0.0

    @classmethod
    def orbit(
        cls,
        sphere: BoundingSphere,
        *,
        azimuth: float = 30.0,
        elevation: float = 10.0,
        distance: float = 4.0,
        size: int = 256,
        lens: float = 0.0,
    ) -> Camera:
        """Looks at the bounding sphere, which fills the picture.

        Arguments:
            azimuth, elevation: Where the camera is, in degrees from +X and above the horizon.
            distance: From the centre, in radii; lens: radius of the lens, in radii.
        """
        if not np.isfinite([azimuth, elevation]).all() or abs(elevation) > 90:
            raise PureLightError("elevation must lie in -90 to 90 degrees")
        if not 1.0 < distance <= 1e4 or not 0 <= lens < distance:
            raise PureLightError("distance must lie in 1 to 10,000 radii, the lens inside it")
        if not 1 <= size <= 16384:
            raise PureLightError("size must be 1 to 16,384 pixels")
        a, e = np.radians([azimuth, elevation])
        outward = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
        target = np.array(sphere.center, np.float64)
        origin = target + outward * distance * sphere.radius
        half_width = MARGIN / np.sqrt(distance**2 - 1)
        return cls(origin, target, float(half_width), size, lens * sphere.radius)

    def rays(self, pixel: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Random rays through pixels.

        Arguments:
            pixel: [N] indices, row by row from the top left.

        Returns:
            Origins and unit directions, [N, 3] each.
        """
        offset = rng.random((len(pixel), 2))
        x = (pixel % self.size + offset[:, 0]) * (2 / self.size) - 1
        y = 1 - (pixel // self.size + offset[:, 1]) * (2 / self.size)
        depth = np.linalg.norm(self.target - self.origin)
        forward, right, up = self._axes()
        plane = np.outer(x, right) + np.outer(y, up)
        focus = self.origin + depth * (forward + self.half_width * plane)
        origin = self.origin + self.lens_radius * self._lens(len(pixel), right, up, rng)
        direction = focus - origin
        return origin, direction / np.linalg.norm(direction, axis=1, keepdims=True)

    def _axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        forward = self.target - self.origin
        forward /= np.linalg.norm(forward)
        vertical = np.array([0.0, 0.0, 1.0] if abs(forward[2]) < 0.999 else [0.0, 1.0, 0.0])
        right = np.cross(forward, vertical)
        right /= np.linalg.norm(right)
        return forward, right, np.cross(right, forward)

    def _lens(
        self, count: int, right: np.ndarray, up: np.ndarray, rng: np.random.Generator
    ) -> np.ndarray:
        """Uniform points on the unit lens: [N, 3]."""
        r, phi = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
        return np.outer(r * np.cos(phi), right) + np.outer(r * np.sin(phi), up)
