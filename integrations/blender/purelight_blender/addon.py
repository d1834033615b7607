"""What the extension adds to Blender, and takes away again."""

from __future__ import annotations

import bpy

from . import handlers, panel, plux_operator, usd_hook

CLASSES = (*plux_operator.CLASSES, *panel.CLASSES, *usd_hook.CLASSES)


def register() -> None:
    """Adds classes, the menu's line and the handlers."""
    for made in CLASSES:
        bpy.utils.register_class(made)
    bpy.types.TOPBAR_MT_file_import.append(plux_operator.menu_line)
    handlers.register()


def unregister() -> None:
    """Takes all of it away, the last first."""
    handlers.unregister()
    bpy.types.TOPBAR_MT_file_import.remove(plux_operator.menu_line)
    for made in reversed(CLASSES):
        bpy.utils.unregister_class(made)
