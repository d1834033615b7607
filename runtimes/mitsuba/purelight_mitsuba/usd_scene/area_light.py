"""Area lights whose radiance varies over the shape or with the angle."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any

import drjit as dr
import mitsuba as mi


class AreaLight(mi.Emitter):
    """Emits from the outside of its shape, and is aimed at evenly by the shape's area.

    Arguments:
        shape: Another one like that which carries the light. That one may be gone while Mitsuba
            still calls the light, as it does with all that a process has seen.
    """

    def __init__(self, shape: mi.Shape) -> None:
        super().__init__(mi.Properties())
        self._shape = shape
        self.m_flags = mi.EmitterFlags.Surface

    @abstractmethod
    def leaving(self, uv: mi.Point2f, outgoing: mi.Vector3f, active: mi.Bool) -> mi.Color3f:
        """Radiance at texture coordinates in a direction of the world, W/(m² sr)."""

    def eval(self, si: Any, active: Any = True) -> mi.Color3f:
        outside = active & (mi.Frame3f.cos_theta(si.wi) > 0)
        return dr.select(outside, self.leaving(si.uv, si.to_world(si.wi), active), 0)

    def sample_direction(
        self, it: Any, sample: Any, active: Any = True
    ) -> tuple[mi.DirectionSample3f, mi.Color3f]:
        ds = self._shape.sample_direction(it, sample, active)
        active = active & (dr.dot(ds.d, ds.n) < 0) & (ds.pdf != 0)
        ds.emitter = mi.EmitterPtr(self)
        return ds, dr.select(active, self.leaving(ds.uv, -ds.d, active) / ds.pdf, 0)

    def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Float:
        pdf = self._shape.pdf_direction(it, ds, active)
        return dr.select(dr.dot(ds.d, ds.n) < 0, pdf, 0)

    def eval_direction(self, it: Any, ds: Any, active: Any = True) -> mi.Color3f:
        return dr.select(dr.dot(ds.d, ds.n) < 0, self.leaving(ds.uv, -ds.d, active), 0)

    def sample_ray(
        self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
    ) -> tuple[mi.Ray3f, mi.Color3f]:
        ps = self._shape.sample_position(time, sample2, active)
        direction = mi.Frame3f(ps.n).to_world(mi.warp.square_to_cosine_hemisphere(sample3))
        weight = self.leaving(ps.uv, direction, active) * (dr.pi / ps.pdf)
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
        return f"{type(self).__name__}[]"


class TexturedArea(AreaLight):
    """Emits a picture.

    Mitsuba's own `area` aims at where the picture is bright, at one point for each place of it: it
    loses light where texture coordinates overlap, repeat or have no area, cannot do without any,
    and ends the process if its shape is gone. This one is right there, and noisier where little of
    the picture shines.

    Arguments:
        radiance: The picture, W/(m² sr).
        shape: As for `AreaLight`.
    """

    def __init__(self, radiance: mi.Texture, shape: mi.Shape) -> None:
        super().__init__(shape)
        self._radiance = radiance

    def leaving(self, uv: mi.Point2f, outgoing: mi.Vector3f, active: mi.Bool) -> mi.Color3f:
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv = uv
        return self._radiance.eval(si, active)
