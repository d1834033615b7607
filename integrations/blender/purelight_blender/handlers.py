"""What is done when a file is opened, a rendering begins, or the renderer is changed."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.app.handlers import persistent

from purelight_format.errors import PureLightError

from . import looks, tables
from .materials import SCRIPT, TABLES

OWNER = object()
WATCHED = ((bpy.types.RenderSettings, "engine"), ("CyclesRenderSettings", "device"),
           ("CyclesRenderSettings", "shading_system"))  # fmt: skip


def refresh() -> list[str]:
    """Puts tables in place and gives lamps their looks; returns what went wrong, line by line."""
    failures = []
    for group in bpy.data.node_groups:
        script, kept = group.nodes.get(SCRIPT), group.nodes.get(TABLES)
        if script is None or kept is None or kept.image is None or tables.KEY not in kept.image:
            continue
        try:
            path = str(tables.file_of(kept.image))
        except PureLightError as error:
            failures.append(str(error))
            continue
        if script.inputs["Tables"].default_value != path:  # Of a linked lamp for this session.
            script.inputs["Tables"].default_value = path
    for scene in bpy.data.scenes:
        if scene.library is None:
            looks.fit(scene)
    return failures


@persistent
def on_event(*_: Any) -> None:
    """Refreshes, and says on the console what went wrong."""
    for line in refresh():
        print(f"PureLight: {line}")


@persistent
def on_load(*_: Any) -> None:
    """A new file has no watches yet."""
    _watch()
    on_event()


def _watch() -> None:
    bpy.msgbus.clear_by_owner(OWNER)
    for holder, name in WATCHED:
        kind = getattr(bpy.types, holder, None) if isinstance(holder, str) else holder
        if kind is not None:
            bpy.msgbus.subscribe_rna(key=(kind, name), owner=OWNER, args=(), notify=on_event)


def _lists() -> list[tuple[Any, Any]]:
    named = (("load_post", on_load), ("render_init", on_event), ("blend_import_post", on_event))
    handlers = bpy.app.handlers
    return [(getattr(handlers, n), call) for n, call in named if hasattr(handlers, n)]


def register() -> None:
    """Begins to listen."""
    for calls, call in _lists():
        calls.append(call)
    _watch()


def unregister() -> None:
    """Stops listening."""
    for calls, call in _lists():
        if call in calls:
            calls.remove(call)
    bpy.msgbus.clear_by_owner(OWNER)
