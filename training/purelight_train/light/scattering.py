"""Light that meets a surface: where it goes on, and what becomes of its power."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

FLAT = 1e-8  # squared distance of unit normals that are the same


@dataclass
class Scattered:
    """Light that leaves a surface.

    Arguments:
        direction: unit vector.
        factor: on the path's weight.
        sharp: whether the event was perfectly smooth or at a null surface, without a finite density
            that `Materials.towards` could give.
    """

    direction: mi.Vector3f
    factor: mi.Color3f
    sharp: mi.Bool


class Materials:
    """The materials of a scene.

    Bump and normal maps tilt normals inside the material, unseen from outside, so that the
    correction below cannot know them: light traced through bumpy glass came out 8% too bright.

    Attributes:
        maps: whether any material has such a map; without, none of it costs anything.
        mapped: by a material's registry index, whether it has.
    """

    def __init__(self, scene: mi.Scene) -> None:
        bsdfs = scene.shapes_dr().bsdf()
        index = [int(i) for i in dr.reinterpret_array(mi.UInt32, bsdfs)]
        table = [False] * (max(index) + 1)
        for i, bsdf in zip(index, bsdfs, strict=True):
            table[i] = any(name in str(bsdf) for name in ("BumpMap", "NormalMap"))
        self.maps, self.mapped = any(table), mi.Bool(table)

    def scatter(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, sampler: mi.Sampler, active: mi.Bool
    ) -> Scattered:
        """Sample the direction in which light that came along a ray leaves the surface it met.

        Light carries importance, so dielectrics conserve its power without an eta² factor.
        Shading normals are corrected for (Veach 1997, p. 155), as in Mitsuba's `ptracer`.
        """
        bsdf, context = si.bsdf(ray), mi.BSDFContext(mi.TransportMode.Importance)
        sample, value = bsdf.sample(
            context, si, sampler.next_1d(active), sampler.next_2d(active), active
        )
        direction = si.to_world(sample.wo)
        shading_in, shading_out = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(sample.wo)
        true_in, true_out = dr.dot(si.n, -ray.d), dr.dot(si.n, direction)
        same_side = (true_in * shading_in > 0) & (true_out * shading_out > 0)
        correction = dr.abs((shading_in * true_out) / (shading_out * true_in))
        # Where the normals agree it is one, but for rounding at grazing angles
        flat = dr.squared_norm(si.sh_frame.n - si.n) < FLAT
        factor = value * dr.select(flat, 1, dr.select(same_side, correction, 0))
        if self.maps:
            mapped = self._mapped(bsdf, active)
            seen = _seen(bsdf, si, sample, value, mapped) * dr.abs(true_out / true_in)
            factor = dr.select(mapped, dr.select(same_side, seen, 0), factor)
        null = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
        sharp = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        return Scattered(direction, dr.select(null, value, factor), sharp)

    def towards(
        self, si: mi.SurfaceInteraction3f, ray: mi.Ray3f, direction: mi.Vector3f, active: mi.Bool
    ) -> mi.Color3f:
        """Part of the light a surface met that it scatters into a direction, per sr.

        Sharp events are left out; otherwise the mean of `scatter`, whose arguments these are.
        """
        bsdf, wo = si.bsdf(ray), si.to_local(direction)
        context = mi.BSDFContext(mi.TransportMode.Importance)
        shading_in, shading_out = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        true_in, true_out = dr.dot(si.n, -ray.d), dr.dot(si.n, direction)
        same_side = (true_in * shading_in > 0) & (true_out * shading_out > 0)
        # Not &=, which would alter the caller's mask
        active = active & same_side & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        correction = dr.abs((shading_in * true_out) / (shading_out * true_in))
        value = bsdf.eval(context, si, wo, active) * correction
        if self.maps:
            mapped = self._mapped(bsdf, active)
            seen = _eval_camera(bsdf, si, wo, mapped) * dr.abs(true_out / true_in)
            value = dr.select(mapped, seen, value)
        return dr.select(active, value, 0)

    def _mapped(self, bsdf: mi.BSDFPtr, active: mi.Bool) -> mi.Bool:
        return active & dr.gather(
            mi.Bool, self.mapped, dr.reinterpret_array(mi.UInt32, bsdf), active
        )


def _seen(
    bsdf: mi.BSDFPtr, si: mi.SurfaceInteraction3f, sample: mi.BSDFSample3f, value: mi.Color3f,
    active: mi.Bool,
) -> mi.Color3f:  # fmt: skip
    """What a camera sees along the sampled path the other way, f*(i, o) = f(o, i).

    Returns:
        BSDF times cosine of incidence over the density of sampling the direction of exit, both
        about the material's own normal.
    """
    delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
    smooth = active & ~delta
    pdf = bsdf.pdf(mi.BSDFContext(mi.TransportMode.Importance), si, sample.wo, smooth)
    seen = _eval_camera(bsdf, si, sample.wo, smooth)
    normal = si.wi + sample.wo * sample.eta  # the one that reflects or refracts so
    tilt = dr.abs(dr.dot(si.wi, normal) / dr.dot(sample.wo, normal))
    return dr.select(delta, value * tilt, dr.select(pdf > 0, seen / pdf, 0))


def _eval_camera(
    bsdf: mi.BSDFPtr, si: mi.SurfaceInteraction3f, outgoing: mi.Vector3f, active: mi.Bool
) -> mi.Color3f:
    """BSDF towards a camera at `outgoing` times cosine of incidence from si.wi."""
    camera = mi.SurfaceInteraction3f(si)
    camera.wi = outgoing
    return bsdf.eval(mi.BSDFContext(mi.TransportMode.Radiance), camera, si.wi, active)
