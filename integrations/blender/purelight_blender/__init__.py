"""Neural luminaires in Blender: an extension that imports `.plux` and USD stages with lamps.

`purelight-blender` makes the zip to install. Within Blender nothing but NumPy and what Blender
carries is needed: the networks become OSL for Cycles.
"""

from __future__ import annotations


def register() -> None:
    """Blender calls this when the extension is switched on."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Blender calls this when the extension is switched off."""
    from . import addon

    addon.unregister()
