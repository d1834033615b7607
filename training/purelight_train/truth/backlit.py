"""What a lamp lets through, by Mitsuba's own integrators: the lamp before an even bright panel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.camera import orbit_axes
from purelight_format.measures import BoundingSphere

Float = NDArray[np.float32]
Image = NDArray[np.float64]
AWAY = 200.0  # radii to the panel: what a lamp is across hardly changes the angle to its rim


@dataclass(frozen=True)
class Backlit:
    """An orthographic picture of a lamp, its emitters off, before a panel of radiance one.

    Arguments:
        sphere: bounding sphere of the lamp; it fills the picture.
        size: pixels along each side.
        azimuth, elevation: of the viewer as seen from the lamp, in degrees.
        half_angle: of the panel as seen from the lamp, in degrees; nearly the whole half-space
            behind the lamp by default. What leaves the lamp past the panel's rim is lost.
    """

    sphere: BoundingSphere
    size: int
    azimuth: float
    elevation: float
    half_angle: float = 89.9

    def lines(self, rng: np.random.Generator) -> tuple[Float, Float]:
        """A line for each pixel, uniform over it: origins and directions [size², 3] by rows."""
        right, up, back = orbit_axes(self.azimuth, self.elevation)
        row, column = np.mgrid[0 : self.size, 0 : self.size].reshape(2, -1)
        u, v = rng.random((2, self.size**2))
        x = ((column + u) / self.size * 2 - 1) * self.sphere.radius
        y = (1 - (row + v) / self.size * 2) * self.sphere.radius
        origin = np.asarray(self.sphere.center) + 2 * self.sphere.radius * back
        origin = origin + x[:, None] * right + y[:, None] * up
        direction = np.broadcast_to(-back, origin.shape)
        return origin.astype(np.float32), np.ascontiguousarray(direction, np.float32)

    def transmitted(self, scene: Any, spp: int, seed: int = 0) -> Image:
        """Light of the panel that passes the lamp, [size, size, 3]; one where nothing is.

        What the lamp's outer faces mirror of the panel is a picture of paths of one bounce by an
        integrator that knows no media, and is subtracted; paths of one bounce through a lamp
        without thickness (a mask, thin glass) go straight on, and are not.
        """
        lit = self._scene(scene)
        whole = self._render(lit, "volpath", spp, -1, seed)
        mirrored = self._render(lit, "path", spp, 2, seed) - self._straight(scene, spp, seed)
        return whole - mirrored

    def _straight(self, scene: Any, spp: int, seed: int) -> Image:
        """What goes on along the line by paths of at most one bounce: seen by a narrow panel."""
        narrow = Backlit(self.sphere, self.size, self.azimuth, self.elevation, 1.0)
        return narrow._render(narrow._scene(scene), "path", spp, 2, seed)

    def _scene(self, scene: Any) -> Any:
        _, up, back = orbit_axes(self.azimuth, self.elevation)
        centre, radius = np.asarray(self.sphere.center), self.sphere.radius
        position = centre - AWAY * radius * back
        half = AWAY * radius * math.tan(math.radians(self.half_angle))
        look_at = mi.ScalarTransform4f().look_at
        panel = {
            "type": "disk",
            "to_world": look_at(list(position), list(centre), list(up))
            @ mi.ScalarTransform4f().scale([half, half, 1]),
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 1.0}},
        }
        shapes = {f"lamp{i}": shape for i, shape in enumerate(scene.shapes())}
        _switch_off(scene)
        return mi.load_dict({"type": "scene", "panel": panel, **shapes})

    def _render(self, scene: Any, method: str, spp: int, depth: int, seed: int) -> Image:
        _, up, back = orbit_axes(self.azimuth, self.elevation)
        centre, radius = np.asarray(self.sphere.center), self.sphere.radius
        camera = mi.ScalarTransform4f().look_at(
            list(centre + 2 * radius * back), list(centre), list(up)
        )
        sensor = mi.load_dict({
            "type": "orthographic", "near_clip": 1e-2 * radius, "far_clip": 1e4 * radius,
            "to_world": camera @ mi.ScalarTransform4f().scale([radius, radius, 1]),
            "film": {
                "type": "hdrfilm", "width": self.size, "height": self.size,
                "rfilter": {"type": "box"}, "pixel_format": "rgb", "component_format": "float32",
            },
        })  # fmt: skip
        integrator = mi.load_dict({"type": method, "max_depth": depth, "rr_depth": 64})
        image = mi.render(scene, sensor=sensor, integrator=integrator, spp=spp, seed=seed)
        return np.array(image).astype(np.float64)[..., :3]


def _switch_off(scene: Any) -> None:
    """Make all emitters of a scene dark, for good."""
    parameters = mi.traverse(scene)
    for name in parameters.keys():  # noqa: SIM118 - no dict
        if name.endswith(("radiance.value", "intensity.value")):
            parameters[name] = 0 * parameters[name]
    parameters.update()
