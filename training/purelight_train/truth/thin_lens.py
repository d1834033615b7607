"""A camera with a thin lens focused on the lamp's centre.

Light that leaves a lamp of smooth glass never meets a pinhole. It meets a lens of finite size with
known probability, and the point of the focal plane it came through says which pixel it belongs to.
A pixel is the mean radiance over its square on the focal plane and over the lens,

    I = 1 / (A_lens A_pixel) ∫∫ L(y, q -> y) dA_y dA_q,

so any picture made of rays over lens and pixels may be compared with it exactly.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.camera import Camera
from purelight_format.measures import BoundingSphere
from purelight_train.light.radiance_field import MARGIN

Float = NDArray[np.float32]


@dataclass(frozen=True)
class ThinLens:
    """A square picture through a round lens that looks at a lamp's centre.

    Arguments:
        sphere: of the lamp; it fills the picture.
        size: pixels along each side.
        azimuth, elevation: of the lens as seen from the lamp, in degrees.
        aperture: radius of the lens over its distance. What lies z in front of the focal plane is
            blurred by a disk of radius aperture * z, up to 1 / (1 - z / distance).
        distance: of the lens from the lamp's centre, in the lamp's radii.
    """

    sphere: BoundingSphere
    size: int
    azimuth: float
    elevation: float
    aperture: float = 0.1
    distance: float = 4.0

    @cached_property
    def camera(self) -> Camera:
        """Where it stands, and its rays."""
        return Camera.orbit(
            self.sphere, azimuth=self.azimuth, elevation=self.elevation, distance=self.distance,
            size=self.size, lens=self.aperture * self.distance, margin=MARGIN,
        )  # fmt: skip

    @property
    def pixel_area(self) -> float:
        """Area of a pixel on the focal plane in m²."""
        return (2 * self.camera.half_side / self.size) ** 2

    def rays(self, rng: np.random.Generator) -> tuple[Float, Float]:
        """One ray for each pixel, uniform over pixel and lens: two of [size², 3], row by row."""
        row, column = np.mgrid[0 : self.size, 0 : self.size].reshape(2, -1)
        u, v, a, b = rng.random((4, self.size**2))
        x, y = (column + u) / self.size * 2 - 1, 1 - (row + v) / self.size * 2
        origin, direction = self.camera.rays_through(x, y, np.sqrt(a), 2 * math.pi * b)
        return origin.astype(np.float32), direction.astype(np.float32)

    def sensor(self) -> dict[str, Any]:
        """The same camera as a Mitsuba sensor."""
        camera = self.camera
        place = [list(vector) for vector in (camera.origin, camera.target, camera.axes[1])]
        return {
            "type": "thinlens",
            "fov": math.degrees(2 * math.atan(camera.half_width)),
            "aperture_radius": camera.lens_radius,
            "focus_distance": camera.distance,
            "near_clip": self.sphere.radius * 1e-2,
            "far_clip": self.sphere.radius * 1e3,
            "to_world": mi.ScalarTransform4f().look_at(*place),
            "film": {
                "type": "hdrfilm", "width": self.size, "height": self.size,
                "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32",
            },
        }  # fmt: skip


def aperture_for(sharp_share: float) -> float:
    """Aperture that trades blur for noise.

    Light that is caught lands in a picture in proportion to the lens's area, so its noise falls
    as one over the aperture. A lamp all of whose light leaves through clear glass gets 10 %; one
    whose light can be joined gets down to 2 %, nearly a pinhole; in between the aperture grows as
    the root of the share, which keeps the noise of what is caught the same part of the whole.
    """
    return min(max(0.1 * math.sqrt(sharp_share), 0.02), 0.1)
