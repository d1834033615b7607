"""What photons draw through a thin lens."""

from __future__ import annotations

import math

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.truth.thin_lens import ThinLens


class LensFilm:
    """Sums of one batch of photons for one lens; values that are not finite are left out.

    Light that arrives at the lens at an angle θ to its axis with irradiance E adds
    E D² / (A_pixel cos⁴θ) to the mean radiance of its pixel, D being the focal plane's distance.
    """

    def __init__(self, lens: ThinLens) -> None:
        self.lens = lens
        self.right, self.up, self.back = (mi.Vector3f(*a.tolist()) for a in lens.camera.axes)
        self.position = mi.Point3f(*lens.camera.origin.tolist())
        self.sums = dr.zeros(mi.Float, 3 * lens.size**2)
        dr.make_opaque(self.sums)

    def point(self, u: mi.Point2f) -> mi.Point3f:
        """A point of the lens, uniform by area, from uniforms in the unit square."""
        disk = mi.warp.square_to_uniform_disk_concentric(u) * self.lens.camera.lens_radius
        return self.position + disk.x * self.right + disk.y * self.up

    def join(
        self, target: mi.Point3f, source: mi.Point3f, intensity: mi.Color3f, active: mi.Bool
    ) -> None:
        """Light of a radiant intensity in W/sr at `source`, towards a random `target`."""
        offset = target - source
        square = dr.squared_norm(offset)
        direction = offset * dr.rsqrt(square)
        cosine = dr.dot(direction, self.back)
        self._add(target, direction, intensity * (cosine / square), active)

    def catch(self, ray: mi.Ray3f, power: mi.Color3f, active: mi.Bool) -> None:
        """Photons of a power in W that fly along a ray and may meet the lens."""
        cosine = dr.dot(ray.d, self.back)
        distance = dr.dot(self.position - ray.o, self.back) / cosine
        target = ray(distance)
        met = dr.squared_norm(target - self.position) < self.lens.camera.lens_radius**2
        area = math.pi * self.lens.camera.lens_radius**2
        self._add(target, ray.d, power / area, active & met & (cosine > 0) & (distance > 0))

    def _add(
        self, target: mi.Point3f, direction: mi.Vector3f, irradiance: mi.Color3f, active: mi.Bool
    ) -> None:
        lens, focus = self.lens, self.lens.camera.distance
        cosine = dr.dot(direction, self.back)
        at = target - direction * (focus / cosine) - mi.Point3f(*lens.sphere.center)
        scale = lens.size / (2 * lens.camera.half_side)
        x = dr.dot(at, self.right) * scale + 0.5 * lens.size
        y = 0.5 * lens.size - dr.dot(at, self.up) * scale
        inside = active & (x >= 0) & (y >= 0) & (x < lens.size) & (y < lens.size)
        radiance = irradiance * (focus**2 / (lens.pixel_area * dr.square(dr.square(cosine))))
        finite = dr.all(dr.isfinite(radiance))
        first = 3 * (mi.UInt32(y) * lens.size + mi.UInt32(x))
        for channel in range(3):
            dr.scatter_add(self.sums, radiance[channel], first + channel, inside & finite)

    def take(self, paths: int) -> NDArray[np.float64]:
        """Radiance [size, size, 3] after that many paths."""
        size = self.lens.size
        return np.array(self.sums, dtype=np.float64).reshape(size, size, 3) / paths
