"""The emitter plugin `purelight_room_only`: a lamp's far field, for Mitsuba's own integrators."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.lamps.emitter import BundleEmitter
from purelight_mitsuba.lamps.frame import Frame
from purelight_mitsuba.sampling.direction_table import DirectionTable
from purelight_mitsuba.sampling.far_field import FarField
from purelight_mitsuba.sampling.surface_sampler import SurfaceSampler


class RoomOnlyEmitter(BundleEmitter):
    """Lights the room in `path` and `volpath`, but is not itself seen, and casts no shadow.

    Every point of the exit surface shines like the whole lamp does from far away, by its IES
    photometry and its flux. So it is right at distances of many radii, has soft shadows of about
    the right size, and needs no network. Mirrors do not show it; light tracers leave it dark.

    Properties: those of `purelight`.

    Raises:
        PureLightError: If the bundle has no photometry.
    """

    def __init__(self, props: mi.Properties) -> None:
        super().__init__(props)
        field = FarField.of(self.luminaire.photometry(), self.luminaire.path.name)
        intensity = field.values[..., None] * self.luminaire.flux
        self._intensity = DirectionTable(intensity)
        self._surface = SurfaceSampler([self.luminaire.surface])
        self.m_flags = mi.EmitterFlags.DeltaPosition

    def _place(self, matrix: np.ndarray, level: float) -> None:
        super()._place(matrix, level)
        placement = self.placement
        x, y, z = (mi.Vector3f(*row) for row in placement.rotation.tolist())
        translation = mi.Point3f(*placement.translation.tolist())
        self._frame = Frame(x, y, z, translation, mi.Float(placement.scale))
        self._brightness = mi.Float(self.level)
        dr.make_opaque(self._frame, self._brightness)

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Spectrum]:
        bits = dr.reinterpret_array(mi.Point2u, sample)
        choice = mi.Point2f(
            mi.sample_tea_float32(bits.x, bits.y), mi.sample_tea_float32(bits.y, bits.x)
        )
        drawn = self._surface.sample(mi.UInt32(0), choice, sample, active)
        ds = dr.zeros(mi.DirectionSample3f)
        ds.p = self._frame.point_to_world(drawn.position)
        ds.d = ds.p - it.p
        square = dr.squared_norm(ds.d)
        ds.dist = dr.sqrt(square)
        ds.d /= ds.dist
        ds.time = it.time
        ds.pdf = dr.select(active & (square > 0), mi.Float(1), 0)
        ds.delta = mi.Bool(True)
        ds.emitter = mi.EmitterPtr(self)
        intensity = self._intensity.at(-self._frame.direction_to_local(ds.d), active)
        factor = dr.square(self._frame.scale) * self._brightness / square
        return ds, dr.select(ds.pdf > 0, intensity * factor, 0)
