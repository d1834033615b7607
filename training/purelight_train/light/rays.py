"""Rays that leave a point of a lamp, whatever the lamp's size."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi


def scene_extent(scene: mi.Scene) -> float:
    """Half the diagonal of the scene's bounding box, in metres."""
    box = scene.bbox()
    return float(0.5 * dr.norm(box.max - box.min))


def leave(
    point: mi.Point3f, normal: mi.Normal3f, direction: mi.Vector3f, extent: mi.Float
) -> mi.Ray3f:
    """A ray from a surface point, lifted off along its normal to the side of `direction`.

    Mitsuba's `spawn_ray` lifts by 9e-5 (1 + |point|), which is 0.1 mm on any small lamp: more
    than the parts of a millimetre lamp are apart. Here the lift is in proportion to the lamp.

    Arguments:
        point, normal, direction: of the vertex, in world space.
        extent: `scene_extent`.
    """
    size = dr.maximum(extent, dr.max(dr.abs(point)))
    lift = dr.mulsign(mi.math.RayEpsilon * size, dr.dot(normal, direction))
    return mi.Ray3f(dr.fma(lift, normal, point), direction)
