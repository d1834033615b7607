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
from purelight_format.ray_file.conversion import rays_of
from purelight_format.ray_file.files import read_ray_file
from purelight_format.ray_file.rays import Rays

NAME = "ray_file"
VARIANT = mi.variant()  # Whose class is derived from.
ALIKE, CLASSES = 1.25, 128  # Rays whose powers differ by less than the factor are one class.


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
        rays = rays_of(read_ray_file(path))
        matrix = np.eye(4)
        if "to_world" in props:
            matrix = np.array(props["to_world"].matrix, np.float64).reshape(4, 4)
        Placement.of(matrix, path.name)  # Refuses shears and mirrors.
        self.rays = rays.moved(matrix)
        self.file = path
        self._scale = _scale(rays, props, path.name)
        self.m_flags = mi.EmitterFlags.SpatiallyVarying
        self._upload()

    def _upload(self) -> None:
        """The rays on the device, in classes of falling power: one is drawn, then a ray in it."""
        share = importance(self.rays)
        order = np.argsort(-share, kind="stable")
        falling = share[order]
        kind = np.minimum(np.log(falling[0] / falling) / np.log(ALIKE), CLASSES - 1).astype(int)
        bound = np.append(np.unique(kind, return_index=True)[1], len(order))
        sums = np.add.reduceat(falling, bound[:-1])
        self._choice = mi.DiscreteDistribution(mi.Float(sums.astype(np.float32)))
        self._bound = mi.UInt32(bound.astype(np.uint32))
        self._position = mi.Float(self.rays.position[order].ravel())
        self._direction = mi.Float(self.rays.direction[order].ravel())
        power = self.rays.power[order] * np.float32(self._scale)
        self._power = mi.Float(power.ravel())

    @property
    def flux(self) -> NDArray[np.float64]:
        """Power in W per channel: [3]."""
        return self.rays.flux * self._scale

    def sample_ray(
        self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Spectrum]:
        active = mi.Mask(active)
        kind, probability = self._choice.sample_pmf(mi.Float(sample1), active)
        first = dr.gather(mi.UInt32, self._bound, kind, active)
        count = dr.gather(mi.UInt32, self._bound, kind + 1, active) - first
        inner = dr.minimum(mi.UInt32(sample2.x * mi.Float(count)), count - 1)
        index = first + inner
        weight = dr.gather(mi.Color3f, self._power, index, active)
        weight *= mi.Float(count) / probability
        ray = dr.zeros(mi.Ray3f)
        ray.o = dr.gather(mi.Point3f, self._position, index, active)
        ray.d = dr.gather(mi.Vector3f, self._direction, index, active)
        ray.maxt = dr.largest(mi.Float)
        ray.time = time
        return ray, weight & active

    def bbox(self) -> mi.ScalarBoundingBox3f:
        low, high = (f(self.rays.position.astype(np.float64), axis=0) for f in (np.min, np.max))
        return mi.ScalarBoundingBox3f(mi.ScalarPoint3f(low), mi.ScalarPoint3f(high))

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
        return f"RayFile[{self.file.name}, {len(self.rays)} rays]"


def importance(rays: Rays) -> NDArray[np.float64]:
    """Mean over the channels of each ray's share of a channel: [N], sums to one."""
    power = rays.power.astype(np.float64)
    total = power.sum(0)
    result: NDArray[np.float64] = (power[:, total > 0] / total[total > 0]).mean(1)
    return result


def _scale(rays: Rays, props: mi.Properties, name: str) -> float:
    if "flux" not in props:
        return 1.0
    flux = float(props["flux"])
    if not (np.isfinite(flux) and flux > 0):
        raise PureLightError(f"{name}: flux must be a number of lumens above 0")
    return flux / rays.lumens
