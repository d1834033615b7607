"""The emitter plugin `ray_file`: measured light, such as that of an LED, inside a lamp's optics.

Import it by `plugins.ray_file_plugin`, once a variant of Mitsuba is set.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.measures import Placement
from purelight_format.ray_file.rays import Rays
from purelight_train.light import ray_set

NAME = "ray_file"
VARIANT = mi.variant()  # Whose class is derived from.


class RayFileEmitter(mi.Emitter):
    """Rays of a file, drawn in proportion to their power: for tracing light, not for cameras.

    Properties: `filename` (a relative path is looked up beside the scene file), `to_world`
    (rotation, uniform scale and translation of the rays, which are in metres; powers stay), `flux`
    (luminous flux in lm to scale the rays to; theirs by default). Light passes the place where rays
    start as if nothing was there: what the LED is made of belongs into the scene.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        if "filename" not in props:
            raise PureLightError("an emitter of type ray_file needs a filename")
        path = Path(str(mi.file_resolver().resolve(str(props["filename"]))))
        self._set = ray_set.load(path)
        self._matrix = np.eye(4)
        if "to_world" in props:
            self._matrix = np.array(props["to_world"].matrix, np.float64).reshape(4, 4)
        self.placement = Placement.of(self._matrix, path.name)  # Refuses shears and mirrors.
        self.file = path
        self._to_world = mi.Transform4f(mi.Matrix4f(self._matrix))
        self._scale = mi.Float(_scale(self._set.rays, props, path.name))
        dr.make_opaque(self._to_world, self._scale)  # One kernel serves all places.
        self.m_flags = mi.EmitterFlags.SpatiallyVarying

    @property
    def rays(self) -> Rays:
        """The rays where they are in the scene, with the powers of the file."""
        return self._set.rays.moved(self._matrix)

    @property
    def flux(self) -> NDArray[np.float64]:
        """Power in W per channel: [3]."""
        return self._set.rays.flux * np.array(self._scale)

    def sample_ray(
        self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Spectrum]:
        active = mi.Mask(active)
        start, direction, weight = self._set.sample(sample1, sample2.x, active)
        ray = dr.zeros(mi.Ray3f)
        ray.o = self._to_world @ start
        ray.d = dr.normalize(self._to_world @ direction)
        ray.maxt = dr.largest(mi.Float)
        ray.time = time
        return ray, (weight * self._scale) & active

    def bbox(self) -> mi.ScalarBoundingBox3f:
        return self._set.bounds(self._to_world)

    # Cameras and next event estimation find nothing: rays have no density that could be asked.

    def eval(self, si: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Spectrum]:
        return dr.zeros(mi.DirectionSample3f), mi.Spectrum(0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Spectrum:
        return mi.Spectrum(0)

    def sample_position(
        self, time: Any, sample: Any, active: Any = True
    ) -> tuple[mi.PositionSample3f, mi.Float]:
        return dr.zeros(mi.PositionSample3f), mi.Float(0)

    def pdf_position(self, ps: Any, active: Any = True) -> mi.Float:
        return mi.Float(0)

    def sample_wavelengths(
        self, si: Any, sample: Any, active: Any = True
    ) -> tuple[Any, mi.Spectrum]:
        return dr.zeros(mi.Color0f), mi.Spectrum(0)

    def to_string(self) -> str:
        return f"RayFile[{self.file.name}, {len(self._set.rays)} rays]"


def _scale(rays: Rays, props: mi.Properties, name: str) -> float:
    if "flux" not in props:
        return 1.0
    flux = float(props["flux"])
    if not (np.isfinite(flux) and flux > 0):
        raise PureLightError(f"{name}: flux must be a number of lumens above 0")
    return flux / rays.lumens
