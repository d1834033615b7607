"""An area light whose radiance depends on the angle to its axis: `ShapingAPI` of UsdLux."""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.sampling.direction_table import DirectionTable
from purelight_mitsuba.usd_scene.area_light import AreaLight
from purelight_mitsuba.usd_scene.shaping import Shaping


class ShapedArea(AreaLight):
    """Emits from the outside of its shape.

    Arguments:
        radiance: [3] before the shaping.
        shaping: The factors.
        shape: As for `AreaLight`.
    """

    def __init__(self, radiance: Any, shaping: Shaping, shape: mi.Shape) -> None:
        super().__init__(shape)
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

    def leaving(self, uv: mi.Point2f, outgoing: mi.Vector3f, active: mi.Bool) -> mi.Color3f:
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
