"""The real lamp, metres across and about the origin, as Mitsuba's own integrators render it.

Mitsuba lifts rays off surfaces by a tenth of a millimetre at metre scale, whatever the lamp's size:
a lamp of centimetres loses per cents of its light. Radiance does not change with size, so pictures
and irradiance in proportion are those of the lamp itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from benchmarks.zoo.lamps.lamp import Lamp, enlarged
from purelight_format.measures import BoundingSphere
from purelight_mitsuba.scene_file import load_scene
from purelight_train.truth.plane import Plane

RADIUS = 20.0  # metres; rays are then lifted by a ten-thousandth of it
LIGHT_TRACING = {"type": "ptracer", "max_depth": -1, "rr_depth": 8}
# Roulette before that thins out what nested glass throws about, to a few paths that weigh much
PATH_TRACING = {"type": "volpath", "max_depth": 256, "rr_depth": 256}
UNSUITED = {"medium", "bump"}  # what `ptracer` ignores, or takes for a shading normal


@dataclass(frozen=True)
class Enlarged:
    """A lamp of `RADIUS` metres; `folder` is for its files."""

    lamp: Lamp
    folder: Path

    @property
    def factor(self) -> float:
        """How many times as large as the lamp itself."""
        return enlarged(self.lamp, RADIUS).scale / self.lamp.placement.scale

    def points(self, points: NDArray[Any]) -> NDArray[np.float64]:
        """Points [..., 3] of the lamp's own frame."""
        moved = np.asarray(points, np.float64) - np.asarray(self.lamp.placement.offset)
        return self.factor * moved

    def sphere(self, sphere: BoundingSphere) -> BoundingSphere:
        x, y, z = self.points(np.asarray(sphere.center)).tolist()
        return BoundingSphere((x, y, z), self.factor * sphere.radius)

    def plane(self, plane: Plane) -> Plane:
        x, y, z = self.points(np.asarray(plane.center)).tolist()
        return Plane((x, y, z), self.factor * plane.side, plane.cells)

    @property
    def light_traceable(self) -> bool:
        """Whether Mitsuba's own light tracer renders the lamp rightly."""
        return not UNSUITED & set(self.lamp.traits)

    @property
    def path_traceable(self) -> bool:
        """Whether a path tracer could find all of the lamp's light, given time.

        What glass or mirrors make of a point light it cannot, and without a single find there is
        no noise that would tell.
        """
        return not self.lamp.lights

    @property
    def integrator(self) -> dict[str, Any]:
        """Mitsuba's light tracer, or its path tracer where that one is not right."""
        return LIGHT_TRACING if self.light_traceable else PATH_TRACING

    @cached_property
    def lit(self) -> dict[str, Any]:
        """The lamp as objects of a scene."""
        return self._objects(lit=True)

    @cached_property
    def dark(self) -> dict[str, Any]:
        """The lamp without its emitters."""
        return self._objects(lit=False)

    def _objects(self, *, lit: bool) -> dict[str, Any]:
        name = "lit" if lit else "dark"
        path = self.lamp.write(self.folder, enlarged(self.lamp, RADIUS), lit=lit, name=name)
        scene = load_scene(path)
        alone = [e for e in scene.emitters() if e.get_shape() is None]
        objects = [*scene.shapes(), *alone]
        return {f"lamp_{k}": value for k, value in enumerate(objects)}

    def instance(self, bundle: Path, **properties: Any) -> dict[str, Any]:
        """The lamp's bundle, enlarged and placed likewise."""
        offset = [float(v) for v in self.points(np.zeros(3))]
        transform = mi.ScalarTransform4f().translate(offset).scale(self.factor)
        lamp = {
            "type": "purelight", "filename": str(bundle.resolve()), "to_world": transform,
            **properties,
        }  # fmt: skip
        return {"lamp": lamp}
