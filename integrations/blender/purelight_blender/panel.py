"""The panel of a lamp in the properties of its object."""

from __future__ import annotations

from typing import Any

import bpy

from . import handlers, looks
from .materials import DIMMER, TINT
from .scene import DIGEST, is_lamp


class OBJECT_PT_purelight(bpy.types.Panel):  # noqa: N801
    """Dimmer and tint of a lamp, and how it is shown"""

    bl_label = "PureLight"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "object"

    @classmethod
    def poll(cls, context: Any) -> bool:
        """Whether the active object is a lamp."""
        return context.object is not None and is_lamp(context.object)

    def draw(self, context: Any) -> None:
        """Draws it."""
        layout, thing = self.layout, context.object
        layout.use_property_split = True
        for name, label in ((DIMMER, "Dimmer"), (TINT, "Tint")):
            if name in thing:
                layout.prop(thing, f'["{name}"]', text=label)
        fault, reason = looks.scaling_fault(thing), looks.obstacle(context.scene)
        if fault:
            layout.label(text=fault, icon="ERROR")
        if reason:
            layout.label(text=looks.NOTE, icon="INFO")
            layout.label(text=reason)
        else:
            layout.label(text="Shown by its networks", icon="CHECKMARK")
        layout.operator(OBJECT_OT_purelight_refresh.bl_idname)
        layout.label(text=thing.data[DIGEST][:16])


class OBJECT_OT_purelight_refresh(bpy.types.Operator):  # noqa: N801
    """Turn Open Shading Language on and give every lamp the look that fits the renderer"""

    bl_idname = "object.purelight_refresh"
    bl_label = "Refresh lamps"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    def execute(self, context: Any) -> set[str]:
        """Does so."""
        looks.switch_on(context.scene)
        failures = handlers.refresh()
        for line in failures:
            self.report({"ERROR"}, line)
        return {"CANCELLED"} if failures else {"FINISHED"}


CLASSES = (OBJECT_OT_purelight_refresh, OBJECT_PT_purelight)
