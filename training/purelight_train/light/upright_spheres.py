"""Spheres that shine, turned upright: what Mitsuba draws on others leaves at wrong angles.

The normal that `Sphere.sample_position` of Mitsuba 3.9 gives for a point is not turned with the
sphere, so a light tracer loses what it sends inwards. A sphere that is turned or mirrored has the
same points as one that is not; whether it shines to the inside stays.
"""

from __future__ import annotations

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError

UPRIGHT = 1e-5  # of the radius


def turn_upright(scene: mi.Scene) -> None:
    """Take rotations and reflections out of the spheres of a scene that shine.

    Raises:
        PureLightError: such a sphere has a texture, which would be turned as well.
    """
    for shape in scene.shapes():
        if shape.is_emitter() and shape.shape_type() == +mi.ShapeType.Sphere:
            _turn_upright(shape)


def _turn_upright(shape: mi.Shape) -> None:
    parameters = mi.traverse(shape)
    matrix: NDArray[np.float64] = np.array(parameters["to_world"].matrix, np.float64).squeeze()
    radius = float(np.linalg.norm(matrix[:3, 0]))
    if np.abs(matrix[:3, :3] - radius * np.eye(3)).max() <= UPRIGHT * radius:
        return
    if _has_texture(shape):
        raise PureLightError(
            f"emitter '{shape.id()}' is a sphere that is turned and has a texture, whose light "
            "Mitsuba draws at wrong angles; give it as a mesh"
        )
    centre = mi.ScalarTransform4f().translate(matrix[:3, 3].tolist())
    parameters["to_world"] = mi.Transform4f(centre.scale(radius))
    parameters.update()


def _has_texture(shape: mi.Shape) -> bool:
    return any(key.endswith("to_uv") for key in mi.traverse(shape).keys())  # noqa: SIM118
