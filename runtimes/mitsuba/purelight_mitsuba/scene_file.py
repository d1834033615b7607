"""A scene's file as Mitsuba reads it, with what Mitsuba 3.9 is wrong about set right.

The normal that `Sphere.sample_position` gives for a point is not turned with the sphere, so a light
tracer loses what it sends inwards. A sphere that is turned or mirrored has the same points as one
that is not: those that shine are turned upright. Whether they shine to the inside stays.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_mitsuba.platform import reading

if TYPE_CHECKING:
    import mitsuba as mi

UPRIGHT = 1e-5  # of the radius


def load_scene(path: Path, **options: Any) -> mi.Scene:
    """What `mi.load_file` makes of a file, on any number of threads, its spheres upright.

    Arguments:
        options: of `mi.load_file`.

    Raises:
        PureLightError: a sphere that shines is turned and has a texture.
        RuntimeError: Mitsuba does not take the file.
    """
    import mitsuba as mi

    with reading():
        scene = mi.load_file(str(path.resolve()), **options)
    if isinstance(scene, mi.Scene):
        _turn_upright(scene)
    return scene


def _turn_upright(scene: mi.Scene) -> None:
    import mitsuba as mi

    for shape in scene.shapes():
        if shape.is_emitter() and shape.shape_type() == +mi.ShapeType.Sphere:
            _turn(shape)


def _turn(shape: mi.Shape) -> None:
    """Take rotation and reflection out of a sphere."""
    import mitsuba as mi

    parameters = mi.traverse(shape)
    matrix: NDArray[np.float64] = np.array(parameters["to_world"].matrix, np.float64).squeeze()
    radius = float(np.linalg.norm(matrix[:3, 0]))
    if np.abs(matrix[:3, :3] - radius * np.eye(3)).max() <= UPRIGHT * radius:
        return
    if any(key.endswith("to_uv") for key in parameters.keys()):  # noqa: SIM118
        raise PureLightError(
            f"emitter '{shape.id()}' is a sphere that is turned and has a texture, whose light "
            "Mitsuba draws at wrong angles; give it as a mesh"
        )
    centre = mi.ScalarTransform4f().translate(matrix[:3, 3].tolist())
    parameters["to_world"] = mi.Transform4f(centre.scale(radius))
    parameters.update()
