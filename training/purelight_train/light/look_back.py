"""Whether light that leaves a surface leaves it as a viewer would see it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.device_array import device_array
from purelight_train.light.exit_surface import NEAR, ExitSurface, mitsuba_mesh


class LookBack:
    """The exit surface on the device, for kernels that trace a lamp's scene as well.

    Not a dataclass, see `light_tracing.Lamp`.

    Arguments:
        room: the lamp's scene, which CUDA needs to share its ray-tracing pipeline.
    """

    def __init__(self, surface: ExitSurface, room: mi.Scene) -> None:
        content = {"type": "scene", "surface": mitsuba_mesh(surface.positions, surface.triangles)}
        if mi.variant().startswith("cuda"):
            content["room"] = room
        self._scene = mi.load_dict(content)
        self._near = dr.opaque(mi.Float, NEAR * surface.sphere.radius)
        table = np.column_stack([surface.outward_normals(), surface.two_sided])
        self._outward = device_array(mi.Float, table)

    def __call__(
        self, position: mi.Point3f, direction: mi.Vector3f, reach: mi.Float, active: mi.Bool
    ) -> mi.Bool:
        """Whether who looks back along light, `reach` metres ahead of a position, meets it there.

        The inner side of a wall does not count: only glass and hollows see it.
        """
        ray = mi.Ray3f(dr.fma(direction, reach, position), -direction)
        found = self._scene.ray_intersect_preliminary(ray, coherent=False, active=active)
        active = active & found.is_valid()
        outward = dr.gather(mi.Vector4f, self._outward, found.prim_index, active)
        outside = (dr.dot(outward.xyz, direction) > 0) | (outward.w > 0)
        return active & outside & (dr.abs(found.t - reach) < dr.minimum(self._near, 0.5 * reach))
