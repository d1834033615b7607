"""Light that meets a surface: where it goes on, and what becomes of its power."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

# Materials whose own sampling of light is not the adjoint of what a camera sees
ONE_WAY = ("BumpMap", "NormalMap", "Principled")


def is_one_way(scene: Any) -> bool:
    """Whether a material of the scene needs `scatter` with `exact`."""
    return any(name in str(shape.bsdf()) for shape in scene.shapes() for name in ONE_WAY)


def scatter(si: Any, ray: Any, sampler: Any, active: Any, *, exact: bool) -> tuple[Any, Any, Any]:
    """Sample the direction in which light leaves a surface.

    Light carries importance, so dielectrics conserve its power without an eta² factor. Shading
    normals are corrected for (Veach 1997, p. 155), as in Mitsuba's `ptracer`.

    Arguments:
        si, ray: where light meets the surface, and how it came.
        exact: weigh by what a camera would see in the opposite direction, f*(i, o) = f(o, i),
            where a material tilts normals on its own or is not reciprocal.

    Returns:
        direction, factor on the path's weight, and whether the surface was passed straight.
    """
    bsdf = si.bsdf(ray)
    sample, value = bsdf.sample(
        mi.BSDFContext(mi.TransportMode.Importance), si,
        sampler.next_1d(active), sampler.next_2d(active), active,
    )  # fmt: skip
    direction = si.to_world(sample.wo)
    null = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Null)
    shading_in, shading_out = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(sample.wo)
    true_in, true_out = dr.dot(si.n, -ray.d), dr.dot(si.n, direction)
    same_side = (true_in * shading_in > 0) & (true_out * shading_out > 0)
    if exact:
        delta = mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta)
        facet = si.wi + sample.wo * sample.eta  # along the normal that reflects or refracts
        tilted = dr.abs(dr.dot(si.wi, facet) / dr.dot(sample.wo, facet))
        value = dr.select(delta, value * tilted, _seen(bsdf, si, sample.wo, active & ~delta))
        factor = value * dr.abs(true_out / true_in)
    else:
        factor = value * dr.abs((shading_in * true_out) / (shading_out * true_in))
    return direction, dr.select(null, value, dr.select(same_side, factor, 0)), null


def _seen(bsdf: Any, si: Any, outgoing: Any, active: Any) -> Any:
    """Radiance a camera in direction `outgoing` sees of light from si.wi, over the pdf of it."""
    pdf = bsdf.pdf(mi.BSDFContext(mi.TransportMode.Importance), si, outgoing, active)
    back = mi.SurfaceInteraction3f(si)
    back.wi = outgoing
    value = bsdf.eval(mi.BSDFContext(mi.TransportMode.Radiance), back, si.wi, active)
    return dr.select(pdf > 0, value / pdf, 0)
