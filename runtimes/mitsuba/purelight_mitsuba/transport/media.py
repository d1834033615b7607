"""Participating media of the room, which paths among lamps do not see."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import mitsuba as mi

NAMED = 3  # Places that a warning names; it counts the others.


class MediaWarning(UserWarning):
    """A scene has participating media, and is rendered without them."""


def ignored(scene: mi.Scene) -> str:
    """One line about the media that a scene is rendered without; empty if it has none."""
    places = list(_places(scene))
    if not places:
        return ""
    more = f" and {len(places) - NAMED} more" if len(places) > NAMED else ""
    return (
        f"rendered without participating media ({', '.join(places[:NAMED])}{more}); remove them, "
        "or render with volpath and its lamps as purelight_room_only"
    )


def _places(scene: mi.Scene) -> Iterator[str]:
    """Where a scene has media: shapes, those of groups included, and sensors."""
    for node in mi.traverse(scene).hierarchy:
        found: dict[str, Any] = {}
        if isinstance(node, mi.Shape):
            found = {"inside": node.interior_medium(), "outside": node.exterior_medium()}
        elif isinstance(node, mi.Sensor):
            found = {"around": node.get_medium()}
        for where, medium in found.items():
            if medium is not None:
                yield f"{medium.id() or 'one'} {where} {node.id() or node.class_name()}"
