"""Inputs of shaders, followed to what they are connected to."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_mitsuba.usd_scene.values import Values

CHANNELS = {1: "r", 2: "ra", 3: "rgb", 4: "rgba"}  # By their number; grey is all colours


def value(shader: Any, name: str, default: Any, values: Values) -> Any:
    """An input's value, followed through the material's interface but not through shaders."""
    source = shader.GetInput(name)
    attributes = source.GetValueProducingAttributes() if source else []
    return values.of(attributes[0] if attributes else None, default)


def connected(shader: Any, name: str) -> tuple[Any, str] | None:
    """The shader that an input takes its value from, and the name of its output; None if none."""
    from pxr import UsdShade

    source = shader.GetInput(name)
    attributes = source.GetValueProducingAttributes() if source else []
    producer = UsdShade.Shader(attributes[0].GetPrim()) if attributes else None
    if not producer or producer.GetPath() == shader.GetPath() or not producer.GetIdAttr().Get():
        return None
    return producer, attributes[0].GetBaseName()


def upstream(shader: Any, kind: str) -> Any:
    """The first shader with an id that begins so, among those that lead to this one, or None."""
    pending, seen = [shader], set()
    while pending:
        found = pending.pop(0)
        if str(found.GetIdAttr().Get()).startswith(kind):
            return found
        seen.add(str(found.GetPath()))
        sources = (connected(found, source.GetBaseName()) for source in found.GetInputs())
        pending += [s[0] for s in sources if s and str(s[0].GetPath()) not in seen]
    return None


def uv_name(shaders: Iterable[Any], values: Values) -> str:
    """The primvar that the first of these shaders to name one reads coordinates from, or `st`."""
    for shader in shaders:
        reader = upstream(shader, "UsdPrimvarReader_float2")
        name = value(reader, "varname", "", values) if reader else ""
        if name:
            return str(name)
    return "st"


def uv_transform(texture: Any, values: Values) -> NDArray[np.float64]:
    """The `UsdTransform2d` before a texture [3, 3]: scale, then rotation, then translation."""
    matrix, source = np.eye(3), connected(texture, "st")
    if source is None or source[0].GetIdAttr().Get() != "UsdTransform2d":
        return matrix
    defaults = (("scale", (1, 1)), ("rotation", 0.0), ("translation", (0, 0)))
    scale, turn, shift = (value(source[0], n, d, values) for n, d in defaults)
    turn = turn if math.isfinite(turn) else 0.0
    sine, cosine = math.sin(math.radians(turn)), math.cos(math.radians(turn))
    matrix[:2, :2] = np.array([[cosine, -sine], [sine, cosine]]) * np.array(scale)
    matrix[:2, 2] = shift
    return matrix


def wrap_mode(texture: Any, values: Values) -> str:
    """How a `UsdUVTexture` goes on, as Mitsuba calls it; what it has no word for is noted."""
    along = [str(value(texture, f"wrap{side}", "useMetadata", values)) for side in "ST"]
    modes = [{"clamp": "clamp", "mirror": "mirror"}.get(wrap, "repeat") for wrap in along]
    if "black" in along:
        values.note(texture.GetPrim(), "a picture with black around it; repeated instead")
    if modes[0] != modes[1]:
        values.note(texture.GetPrim(), f"goes on by {modes[0]} along both axes, not {modes[1]}")
    return modes[0]
