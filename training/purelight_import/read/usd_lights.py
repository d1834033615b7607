"""UsdLux lights: those with a shape become parts, those at infinity are the room's."""

from __future__ import annotations

from typing import Any

import numpy as np

from purelight_import.model.material import RGB, Material
from purelight_import.read.build import Builder
from purelight_import.read.solids import SOLIDS
from purelight_mitsuba.usd_scene.values import Values

ROOM = ("DistantLight", "DomeLight", "DomeLight_1")


KINDS = (
    "SphereLight", "DiskLight", "RectLight", "CylinderLight", *ROOM,
)  # fmt: skip


def mesh_light(prim: Any, values: Values, area: float) -> RGB | None:
    """Radiance of a mesh that is a light (`MeshLightAPI`), whatever its material; None if dark."""
    from purelight_mitsuba.usd_scene import lights

    r, g, b = lights.strength(prim, values)
    if values.get(prim, "inputs:normalize", False):
        r, g, b = (value / area for value in (r, g, b))
    return (r, g, b) if max(r, g, b) > 0 and np.isfinite([r, g, b]).all() else None


def add_light(prim: Any, values: Values, builder: Builder) -> None:
    """Adds a light's shape, by the formulas of the runtime's USD reader."""
    if str(prim.GetTypeName()) in ROOM:
        builder.room.append(prim.GetName())
        return

    from purelight_mitsuba.usd_scene import lights
    from purelight_mitsuba.usd_scene.shaped_area import ShapedArea

    def note(_: Any, text: str) -> None:
        builder.notes(text, prim.GetName())

    for light in lights.light(prim, values, note):
        emitter = light["emitter"]
        if isinstance(emitter, ShapedArea):
            note(None, "the shaping of lights is not taken: they shine evenly")
            radiance = emitter.radiance
        else:
            radiance = emitter["radiance"]["value"]
        r, g, b = map(float, radiance)
        path = tuple(part for part in str(prim.GetPath()).split("/") if part)
        at = np.array(light["to_world"].matrix, np.float64)
        mesh = SOLIDS[light["type"]]().moved(at)
        black = Material("light", (0.0, 0.0, 0.0), 0.0, 1.0, specular=0.0)
        builder.add(prim.GetName(), mesh, black, path, (r, g, b))
