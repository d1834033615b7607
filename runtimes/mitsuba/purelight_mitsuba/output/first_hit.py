"""What a picture shows first along each ray: albedo, normal and depth, lamps included."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.lamps.emitter import PureLightEmitter
from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Lamps

SAMPLES = 16


class FirstHitIntegrator(mi.SamplingIntegrator):
    """Arbitrary output variables for denoisers and compositing.

    A lamp counts as white, as light sources do for denoisers, and hides what is behind its glass.

    Arguments:
        scene: Whose lamps are seen.
        hide_emitters: Whether the picture shows neither lamps nor what shines of Mitsuba's own.
    """

    def __init__(self, scene: mi.Scene, *, hide_emitters: bool = False) -> None:
        super().__init__(mi.Properties())
        self._hides = hide_emitters
        seen = () if hide_emitters else scene.emitters()
        emitters = [e for e in seen if isinstance(e, PureLightEmitter)]
        self._lamps = Lamps(emitters, scene) if emitters else None

    def aov_names(self) -> list[str]:
        """Channels after the picture's own, which is the albedo."""
        return ["normal.X", "normal.Y", "normal.Z", "depth.Z", "hit.Y"]

    def sample(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.RayDifferential3f,
        medium: Any = None,
        active: mi.Bool = True,
    ) -> tuple[mi.Color3f, mi.Bool, list[mi.Float]]:
        if self._hides:
            found = self.skip_area_emitters(scene, mi.Ray3f(ray), True, active)
        else:
            found = scene.ray_intersect_preliminary(mi.Ray3f(ray), True, active)
        si = found.compute_surface_interaction(mi.Ray3f(ray), mi.RayFlags.All, active)
        valid = active & si.is_valid()
        bsdf = si.bsdf(ray)
        albedo = dr.select(valid, bsdf.eval_diffuse_reflectance(si, valid), 0)
        normal = dr.select(valid, si.sh_frame.n, 0)
        depth = dr.select(valid, si.t, dr.inf)
        if self._lamps is not None:
            before = mi.Ray3f(ray)
            before.maxt = dr.minimum(before.maxt, depth)
            hit = self._lamps.intersect(before, mi.Bool(active))
            albedo = dr.select(hit.valid, 1, albedo)
            normal = dr.select(hit.valid, self._normal(hit, ray), normal)
            depth = dr.select(hit.valid, hit.t, depth)
            valid = valid | hit.valid
        seen = dr.select(valid, mi.Float(1), 0)
        return albedo, valid, [*normal, dr.select(valid, depth, 0), seen]

    def _normal(self, hit: Hit, ray: mi.Ray3f) -> mi.Normal3f:
        """A lamp's normal in the world, on the side of the ray's origin."""
        assert self._lamps is not None
        place = self._lamps.place(hit.lamp, hit.valid)
        normal = place.direction_to_world(mi.Vector3f(hit.normal))
        return mi.Normal3f(dr.select(dr.dot(normal, ray.d) > 0, -normal, normal))


def layers(scene: mi.Scene, seed: int = 0, *, hide_emitters: bool = False) -> dict[str, np.ndarray]:
    """Renders the first sensor's output variables.

    Arguments:
        hide_emitters: As the picture's integrator has it.

    Returns:
        `albedo` [H, W, 3]; `normal` [H, W, 3] in the world, shorter than one where a pixel
        shows several; and `depth` [H, W, 1], the mean distance of what a pixel shows, infinite
        where it shows nothing.
    """
    integrator = FirstHitIntegrator(scene, hide_emitters=hide_emitters)
    image = np.array(mi.render(scene, integrator=integrator, spp=SAMPLES, seed=seed))
    names = 3 + len(integrator.aov_names())
    albedo, rest = image[..., :3], image[..., image.shape[-1] - names + 3 :]
    seen = rest[..., 4:]
    depth = np.divide(rest[..., 3:4], seen, out=np.full_like(seen, np.inf), where=seen > 0)
    return {"albedo": albedo, "normal": rest[..., :3], "depth": depth}
