"""An area light whose radiance depends on the angle to its axis: `ShapingAPI` of UsdLux."""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.sampling.direction_table import DirectionTable
from purelight_mitsuba.usd_scene.shaping import Shaping


class ShapedArea(mi.Emitter):
    """Emits from the outside of its shape.

    Arguments:
        radiance: [3] before the shaping.
        shaping: The factors.
        shape: Another one like that which carries the light. That one may be gone while Mitsuba
            still calls the light, as it does with all that a process has seen.
    """

    def __init__(self, radiance: Any, shaping: Shaping, shape: mi.Shape) -> None:
        super().__init__(mi.Properties())
        self._shape = shape
        self.m_flags = mi.EmitterFlags.Surface
        self.radiance = tuple(map(float, radiance))
        self._radiance = mi.Color3f(*self.radiance)
        self._rows = [mi.Vector3f(*row) for row in shaping.to_local.tolist()]
        self._tint = mi.Color3f(*map(float, shaping.tint))
        self._focus = mi.Float(shaping.focus)
        cone = math.radians(shaping.cone)
        self._cone, self._start = mi.Float(cone), mi.Float(cone * (1 - shaping.softness))
        self._angle_scale = mi.Float(shaping.angle_scale)
        dr.make_opaque(
            self._radiance, self._rows, self._tint, self._focus, self._cone, self._start,
            self._angle_scale,
        )  # fmt: skip
        self._shaping = shaping
        profile = shaping.profile
        self._profile = None
        if profile is not None:
            self._profile = DirectionTable(np.repeat(profile[..., None], 3, -1))

    def _leaving(self, outgoing: mi.Vector3f, active: mi.Bool) -> mi.Color3f:
        """Radiance in a direction of the world."""
        local = mi.Vector3f(*(dr.dot(row, outgoing) for row in self._rows))
        result = self._radiance
        if self._shaping.focus > 0:
            result = result * dr.lerp(self._tint, mi.Color3f(1), dr.abs(local.z) ** self._focus)
        if self._shaping.cone < 180:
            result = result * self._within(dr.safe_acos(-local.z))
        if self._profile is not None:
            result = result * self._looked_up(self._profile, local, active)
        return result

    def _within(self, angle: mi.Float) -> mi.Float:
        """1 within the cone, 0 outside, a smooth step where it fades."""
        width = self._cone - self._start
        hard = dr.select(angle <= self._cone, mi.Float(1), 0)
        t = dr.clip((angle - self._start) / dr.maximum(width, 1e-6), 0, 1)
        return dr.select(width > 1e-6, 1 - dr.square(t) * (3 - 2 * t), hard)

    def _looked_up(
        self, profile: DirectionTable, local: mi.Vector3f, active: mi.Bool
    ) -> mi.Color3f:
        angle = dr.safe_acos(-local.z)
        if self._shaping.angle_scale > 0:
            angle = angle / self._angle_scale
        elif self._shaping.angle_scale < 0:
            angle = (angle - dr.pi) / -self._angle_scale + dr.pi
        turn = dr.atan2(local.y, local.x) * dr.inv_two_pi
        return profile.at_angles(dr.clip(angle, 0, dr.pi), turn, active)

    def eval(self, si: Any, active: Any = True) -> mi.Color3f:
        outside = active & (mi.Frame3f.cos_theta(si.wi) > 0)
        return dr.select(outside, self._leaving(si.to_world(si.wi), active), 0)

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        ds = self._shape.sample_direction(it, sample, active)
        active = active & (dr.dot(ds.d, ds.n) < 0) & (ds.pdf != 0)
        ds.emitter = mi.EmitterPtr(self)
        return ds, dr.select(active, self._leaving(-ds.d, active) / ds.pdf, 0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        pdf = self._shape.pdf_direction(it, ds, active)
        return dr.select(dr.dot(ds.d, ds.n) < 0, pdf, 0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Color3f:
        return dr.select(dr.dot(ds.d, ds.n) < 0, self._leaving(-ds.d, active), 0)

    def sample_ray(
        self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Color3f]:
        ps = self._shape.sample_position(time, sample2, active)
        direction = mi.Frame3f(ps.n).to_world(mi.warp.square_to_cosine_hemisphere(sample3))
        weight = self._leaving(direction, active) * (dr.pi / ps.pdf)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.p, si.n, si.time = ps.p, ps.n, mi.Float(time)
        return si.spawn_ray(direction), dr.select(ps.pdf > 0, weight, 0)

    def sample_position(
        self, time: Any, sample: Any, active: Any = True
    ) -> tuple[mi.PositionSample3f, mi.Float]:
        ps = self._shape.sample_position(time, sample, active)
        return ps, dr.select(ps.pdf > 0, 1 / ps.pdf, 0)

    def pdf_position(self, ps: Any, active: Any = True) -> mi.Float:
        return self._shape.pdf_position(ps, active)

    def sample_wavelengths(self, si: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
        return dr.zeros(mi.Color0f), self.eval(si, active)

    def bbox(self) -> mi.ScalarBoundingBox3f:
        return self._shape.bbox()

    def to_string(self) -> str:
        return "ShapedArea[]"
