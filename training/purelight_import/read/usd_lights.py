"""UsdLux lights: those with a shape become parts, those at infinity are the room's."""

from __future__ import annotations

from typing import Any

import numpy as np

from purelight_import.model.color import KELVIN, black_body
from purelight_import.model.material import RGB, Material
from purelight_import.read.build import Builder
from purelight_import.read.solids import SOLIDS
from purelight_mitsuba.usd_scene import lights
from purelight_mitsuba.usd_scene.values import Values

KINDS = lights.KINDS
ROOM = ("DistantLight", "DomeLight", "DomeLight_1")
TEMPERATURE = "inputs:enableColorTemperature"


def add_light(prim: Any, values: Values, builder: Builder) -> None:
    """Adds a light's shape, by the formulas of the runtime's USD reader."""
    if str(prim.GetTypeName()) in ROOM:
        builder.room.append(prim.GetName())
        return

    def note(_: Any, text: str) -> None:
        if not text.startswith("colorTemperature"):
            builder.notes(text, prim.GetName())

    for light in lights.light(prim, values, note):
        r, g, b = (
            value * tint
            for value, tint in zip(
                light["emitter"]["radiance"]["value"], _tint(prim, values), strict=True
            )
        )
        path = tuple(part for part in str(prim.GetPath()).split("/") if part)
        at = np.array(light["to_world"].matrix, np.float64)
        mesh = SOLIDS[light["type"]]().moved(at)
        black = Material("light", (0.0, 0.0, 0.0), 0.0, 1.0, specular=0.0)
        builder.add(prim.GetName(), mesh, black, path, (r, g, b))


def _tint(prim: Any, values: Values) -> RGB:
    """The colour of a light's temperature, of luminance one."""
    if not values.get(prim, TEMPERATURE, False):
        return 1.0, 1.0, 1.0
    return black_body(float(np.clip(values.number(prim, "inputs:colorTemperature", 6500), *KELVIN)))
