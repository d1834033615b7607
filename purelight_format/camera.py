"""A camera that looks at a luminaire: a pinhole, or a thin lens focused on its centre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere

MARGIN = 1.08


def orbit_axes(azimuth: float, elevation: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors [3] to the right and up in a picture, and from what it shows to the viewer.

    Arguments:
        azimuth, elevation: Where the viewer is, in degrees from +X and above the horizon.
    """
    a, e = np.radians((azimuth, elevation))
    back = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return right, np.cross(back, right), back


@dataclass(frozen=True)
class Camera:
    """A square picture of what lies around `target`.

    Arguments:
        target: [3] the point in the middle of the picture and in focus, in metres.
        axes: Unit vectors [3] to the right, up, and from the target to the camera.
        distance: From the target, in metres.
        half_width: Tangent of half the field of view.
        size: Pixels along each side.
        lens_radius: Radius of the lens in metres; zero is a pinhole.
    """

    target: np.ndarray
    axes: tuple[np.ndarray, np.ndarray, np.ndarray]
    distance: float
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
        margin: float = MARGIN,
    ) -> Camera:
        """Looks at the bounding sphere, which fills the picture.

        Arguments:
            azimuth, elevation: Where the camera is, in degrees from +X and above the horizon.
            distance: From the centre, in radii.
            size: Pixels along each side.
            lens: Radius of the lens, in radii; zero is a pinhole.
            margin: Of the picture's width over the sphere's.
        """
        if not np.isfinite([azimuth, elevation]).all() or abs(elevation) > 90:
            raise PureLightError("elevation must lie in -90 to 90 degrees")
        if not 1.0 < distance <= 1e4 or not 0 <= lens < distance:
            raise PureLightError("distance must lie in 1 to 10,000 radii, the lens inside it")
        if not 1 <= size <= 16384:
            raise PureLightError("size must be 1 to 16,384 pixels")
        return cls(
            np.array(sphere.center, np.float64), orbit_axes(azimuth, elevation),
            distance * sphere.radius, float(margin / np.sqrt(distance**2 - 1)), size,
            lens * sphere.radius,
        )  # fmt: skip

    @property
    def origin(self) -> np.ndarray:
        """Where the camera, or the centre of its lens, is: [3] in metres."""
        return self.target + self.distance * self.axes[2]

    @property
    def half_side(self) -> float:
        """Half the side of the picture on the plane in focus, in metres."""
        return self.half_width * self.distance

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
        r, phi = np.sqrt(rng.random(len(pixel))), 2 * np.pi * rng.random(len(pixel))
        return self.rays_through(x, y, r, phi)

    def middle_rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Rays from the middle of the lens through those of all pixels, row by row, as `rays`."""
        middle = (np.arange(self.size) + 0.5) / self.size * 2 - 1
        x, y = (side.ravel() for side in np.meshgrid(middle, -middle))
        return self.rays_through(x, y, np.zeros_like(x), np.zeros_like(x))

    def rays_through(
        self, x: np.ndarray, y: np.ndarray, r: np.ndarray, phi: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rays through points of the picture from points of the lens, as `rays`.

        Arguments:
            x, y: [N] to the right and up in the picture, whose sides are at -1 and 1.
            r, phi: [N] over the lens's radius, and the angle from the right towards above.
        """
        right, up, back = self.axes
        shift = np.outer(r * np.cos(phi), right) + np.outer(r * np.sin(phi), up)
        start = self.lens_radius * shift + self.distance * back
        direction = self.half_side * (np.outer(x, right) + np.outer(y, up)) - start
        return self.target + start, direction / np.linalg.norm(direction, axis=1, keepdims=True)
