"""Whether a glass surface is one face of a thin wall, whose other face mirrors the same way."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_train.light.exit_surface import ExitSurface
from purelight_train.light.interfaces import Interfaces

RAYS = 1 << 12
THIN, PARALLEL = 0.1, 0.98  # of the sphere's radius; cosine between the faces
MOSTLY = 0.5


def thin_walls(scene: mi.Scene, surface: ExitSurface, triangles: NDArray[np.int64]) -> bool:
    """Whether most of some triangles have a smooth parallel glass face close behind.

    Arguments:
        triangles: [P] of the exit surface.
    """
    rng = np.random.default_rng(11)
    area = surface.triangle_area[triangles]
    chosen = triangles[rng.choice(len(triangles), RAYS, p=area / area.sum())]
    inward = -surface.outward_normals()[chosen].astype(np.float32)
    origin = (
        surface.points_of(chosen, rng.random((2, RAYS))) + 1e-5 * surface.sphere.radius * inward
    )
    ray = mi.Ray3f(mi.Point3f(origin.T), mi.Vector3f(inward.T))
    si = scene.ray_intersect(ray)
    bsdf, interfaces = si.bsdf(), Interfaces(scene)
    valid = np.array(si.is_valid())
    glass = np.abs(np.array(interfaces.behind(bsdf, si.is_valid())) - 1) > 1e-3
    smooth = (np.array(bsdf.flags()) & int(mi.BSDFFlags.Smooth)) == 0
    parallel = np.abs((np.array(si.n).T * inward).sum(1)) > PARALLEL
    near = np.array(si.t) < THIN * surface.sphere.radius
    return bool((valid & glass & smooth & parallel & near).mean() > MOSTLY)
