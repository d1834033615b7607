"""File > Import > PureLight lamp (.plux), and lamps dropped into a 3D view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from purelight_format.errors import PureLightError

from . import lamp, looks, scene


class IMPORT_SCENE_OT_plux(bpy.types.Operator, ImportHelper):  # noqa: N801
    """Import PureLight lamps"""

    bl_idname = "import_scene.plux"
    bl_label = "Import PureLight lamp"
    bl_options = {"REGISTER", "UNDO"}  # noqa: RUF012

    filename_ext = ".plux"
    filter_glob: StringProperty(default="*.plux", options={"HIDDEN"})  # type: ignore[valid-type]
    files: CollectionProperty(  # type: ignore[valid-type]
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})  # type: ignore[valid-type]
    at_cursor: BoolProperty(  # type: ignore[valid-type]
        name="Place at the 3D cursor", default=True, description="Otherwise at the world's origin"
    )

    def execute(self, context: Any) -> set[str]:
        """Reads every lamp, and only then touches the scene."""
        try:
            found = [lamp.read(path) for path in self._paths()]
            made = self._place(context, found)
        except PureLightError as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        self._tell(context.scene, found, made)
        return {"FINISHED"}

    def invoke(self, context: Any, event: Any) -> set[str]:
        """Dropped files are taken as they are, else a file is asked for."""
        if self.directory and self.files:
            return self.execute(context)
        return set(ImportHelper.invoke(self, context, event))

    def _paths(self) -> list[Path]:
        """Absolute: beside the .blend where they begin with //, as Blender says it."""
        folder = Path(bpy.path.abspath(self.directory))
        named = [folder / file.name for file in self.files if file.name]
        return named or [Path(bpy.path.abspath(self.filepath))]

    def _place(self, context: Any, found: list[lamp.Lamp]) -> list[Any]:
        before = scene.Cleaner()
        scale = 1 / context.scene.unit_settings.scale_length
        looks.switch_on(context.scene)
        try:
            made = [scene.add(one, context.collection, scale) for one in found]
        except PureLightError:
            before.clean()
            raise
        for thing in made:
            thing.location = context.scene.cursor.location if self.at_cursor else (0, 0, 0)
        looks.fit(context.scene)
        _select(context, made)
        return made

    def _tell(self, about: Any, found: list[lamp.Lamp], made: list[Any]) -> None:
        for one in found:
            for line in one.warnings[:3]:
                self.report({"WARNING"}, f"{one.name}: {line}")
        reason = looks.obstacle(about)
        names = ", ".join(thing.name for thing in made)
        if reason:
            self.report({"WARNING"}, f"{names}: {looks.NOTE}. For the lamp itself: {reason}")
        else:
            self.report({"INFO"}, f"{names}: imported; Open Shading Language is on")


def _select(context: Any, made: list[Any]) -> None:
    context.view_layer.update()
    for thing in context.view_layer.objects:
        thing.select_set(False)
    for thing in made:
        if thing.name in context.view_layer.objects:
            thing.select_set(True)
            context.view_layer.objects.active = thing


class IO_FH_plux(bpy.types.FileHandler):  # noqa: N801
    """Lamps that are dropped into a 3D view or the outliner."""

    bl_idname = "IO_FH_plux"
    bl_label = "PureLight lamp"
    bl_import_operator = "import_scene.plux"
    bl_file_extensions = ".plux"

    @classmethod
    def poll_drop(cls, context: Any) -> bool:
        """Where they may be dropped."""
        return bool(context.area and context.area.type in {"VIEW_3D", "OUTLINER"})


def menu_line(self: Any, context: Any) -> None:
    """The line in File > Import."""
    self.layout.operator(IMPORT_SCENE_OT_plux.bl_idname, text="PureLight lamp (.plux)")


CLASSES = (IMPORT_SCENE_OT_plux, IO_FH_plux)
