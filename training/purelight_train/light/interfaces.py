"""Which side of each material has the lower index of refraction."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

PROBES = 256


class Interfaces:
    """The refractive indices of the materials of a scene.

    Attributes:
        eta: by a material's registry index, the index behind its surface over that before it; one
            where nothing is refracted.
    """

    def __init__(self, scene: mi.Scene) -> None:
        bsdfs = scene.shapes_dr().bsdf()
        index = [int(i) for i in dr.reinterpret_array(mi.UInt32, bsdfs)]
        table = np.ones(max(index) + 1, np.float32)
        for i, bsdf in dict(zip(index, bsdfs, strict=True)).items():
            table[i] = relative_index(bsdf)
        self.eta = mi.Float(table)

    def behind(self, bsdf: mi.BSDFPtr, active: mi.Bool) -> mi.Float:
        """Index behind the surface over that before it."""
        return dr.gather(mi.Float, self.eta, dr.reinterpret_array(mi.UInt32, bsdf), active)

    def relative(self, bsdf: mi.BSDFPtr, si: mi.SurfaceInteraction3f, active: mi.Bool) -> mi.Float:
        """Index on the far side of the surface over that on the side of si.wi."""
        eta = self.behind(bsdf, active)
        return dr.select(mi.Frame3f.cos_theta(si.wi) >= 0, eta, dr.rcp(eta))


def relative_index(bsdf: mi.BSDF) -> float:
    """Index behind a material over that before it, from light that falls in at right angles."""
    si = dr.zeros(mi.SurfaceInteraction3f, PROBES)
    si.wi = mi.Vector3f(0, 0, 1)
    si.n = mi.Normal3f(0, 0, 1)
    x, y = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)  # bumps have slopes along these
    si.sh_frame, si.dp_du, si.dp_dv = mi.Frame3f(x, y, mi.Vector3f(0, 0, 1)), x, y
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, PROBES)
    sample, weight = bsdf.sample(
        mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d(), mi.Bool(True)
    )
    columns = (mi.Frame3f.cos_theta(sample.wo), dr.max(weight), sample.eta)
    cosine, power, eta = (np.broadcast_to(np.array(c), PROBES) for c in columns)
    refracted = eta[(cosine < 0) & (power > 0) & (eta != 1)]  # holes of a mask refract nothing
    return float(np.median(refracted)) if len(refracted) else 1.0
