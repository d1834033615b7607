"""Inputs of shaders, followed to what they are connected to."""

from __future__ import annotations

from typing import Any

from purelight_mitsuba.usd_scene.values import Values


def value(shader: Any, name: str, default: Any, values: Values) -> Any:
    """An input's value, followed through the material's interface but not through shaders."""
    source = shader.GetInput(name)
    attributes = source.GetValueProducingAttributes() if source else []
    found = attributes[0].Get(values.time) if attributes else None
    return default if found is None else found


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
