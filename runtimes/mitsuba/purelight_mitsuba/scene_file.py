"""A scene's file as Mitsuba reads it, with what Mitsuba 3.9 is wrong about set right, or refused.

The normal that `Sphere.sample_position` gives for a point is not turned with the sphere, so a light
tracer loses what it sends inwards. A sphere that is turned or mirrored has the same points as one
that is not: those that shine are turned upright; whether they shine to the inside stays. A cylinder
that is mirrored is seen to shine on one side, and light is drawn on the other. A mesh that shines
by a picture and has no texture coordinates cannot be aimed at, and spoils every other scene too.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_mitsuba.platform import reading

if TYPE_CHECKING:
    import mitsuba as mi

UPRIGHT = 1e-5  # of the radius
OURS = re.compile(r"PureLightError: (.*)")


def load_scene(path: Path, **options: Any) -> mi.Scene:
    """What `mi.load_file` makes of a file, on any number of threads, its spheres upright.

    Arguments:
        options: of `mi.load_file`.

    Raises:
        PureLightError: Mitsuba or a lamp in the scene does not take the file; a sphere that shines
            is turned and has a texture, a cylinder that shines is mirrored, or a mesh that shines
            by a picture has no texture coordinates.
    """
    import mitsuba as mi

    try:
        with reading():
            scene = mi.load_file(str(path.resolve()), **options)
    except Exception as error:  # A plugin in Python may raise anything.
        told = reason(str(error))
        kind = "" if OURS.search(str(error)) else "not a Mitsuba 3 scene: "
        raise PureLightError(f"{path}: {kind}{told}") from error
    if isinstance(scene, mi.Scene):
        mended = {
            +mi.ShapeType.Sphere: _turn_upright,
            +mi.ShapeType.Cylinder: _refuse_mirrored,
            +mi.ShapeType.Mesh: _refuse_unplaced,
        }
        for shape in scene.shapes():
            if shape.is_emitter() and shape.shape_type() in mended:
                mended[shape.shape_type()](shape)
    return scene


def reason(text: str) -> str:
    """The line of a Mitsuba error that says what is wrong."""
    ours = OURS.findall(text)
    if ours:
        return str(ours[-1])
    lines = [re.sub(r"^\[[^\]]*\]\s*", "", line).strip() for line in text.splitlines()]
    return " ".join(line for line in lines if line)[-300:]


def _turn_upright(shape: mi.Shape) -> None:
    """Take rotation and reflection out of a sphere."""
    import mitsuba as mi

    place = _place(shape)
    radius = float(np.linalg.norm(place[:3, 0]))
    if np.abs(place[:3, :3] - radius * np.eye(3)).max() <= UPRIGHT * radius:
        return
    parameters = mi.traverse(shape)
    if any(key.endswith("to_uv") for key in parameters.keys()):  # noqa: SIM118
        raise PureLightError(
            f"emitter '{shape.id()}' is a sphere that is turned and has a texture, whose light "
            "Mitsuba draws at wrong angles; give it as a mesh"
        )
    centre = mi.ScalarTransform4f().translate(place[:3, 3].tolist())
    parameters["to_world"] = mi.Transform4f(centre.scale(radius))
    parameters.update()


def _refuse_mirrored(shape: mi.Shape) -> None:
    if np.linalg.det(_place(shape)[:3, :3]) < 0:
        raise PureLightError(
            f"emitter '{shape.id()}' is a cylinder that is mirrored, whose light Mitsuba draws on "
            "the side that it does not show; turn it instead, or give it as a mesh"
        )


def _refuse_unplaced(shape: mi.Shape) -> None:
    import mitsuba as mi

    pictures = [key for key in mi.traverse(shape.emitter()).keys() if key.endswith("to_uv")]  # noqa: SIM118
    if pictures and not shape.has_vertex_texcoords():
        raise PureLightError(
            f"emitter '{shape.id()}' shines by a texture, but its mesh has no texture coordinates; "
            "give it some, or one radiance"
        )


def _place(shape: mi.Shape) -> NDArray[np.float64]:
    import mitsuba as mi

    return np.array(mi.traverse(shape)["to_world"].matrix, np.float64).squeeze()
