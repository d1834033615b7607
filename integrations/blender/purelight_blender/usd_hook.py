"""Lamps on USD stages: Blender imports the stage, and this puts lamps where their stand-ins are."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import bpy

from purelight_format.errors import PureLightError
from purelight_format.measures import Placement
from purelight_format.usd.luminaires import LuminairePrim, luminaires

from . import lamp, looks, scene
from .materials import DIMMER


class WM_USD_purelight(bpy.types.USDHook):  # noqa: N801
    """Called by Blender's own USD importer."""

    bl_idname = "WM_USD_purelight"
    bl_label = "PureLight lamps"
    bl_description = "Puts PureLight lamps in place of their stand-in lights"

    @staticmethod
    def on_import(context: Any) -> bool:
        """Adds the lamps of the imported stage; one that is at fault keeps its stand-in."""
        stage = context.get_stage()
        found = {prim.path: prim for prim in luminaires(stage)}
        if not found:
            return True
        objects = {
            str(path): next(
                (block for block in blocks if isinstance(block, bpy.types.Object)), None
            )
            for path, blocks in context.get_prim_map().items()
        }
        looks.switch_on(bpy.context.scene)
        places = Places(stage, objects)
        for prim in found.values():
            try:
                places.put(prim)
            except PureLightError as error:
                _tell(f"{prim.path}: {error}; its stand-in light is kept")
        looks.fit(bpy.context.scene)
        reason = looks.obstacle(bpy.context.scene)
        if reason:
            _tell(f"lamps are {looks.NOTE}. For the lamps themselves: {reason}")
        return True


@dataclass
class Places:
    """Where lamps go among what Blender made of a stage.

    Arguments:
        stage: A `Usd.Stage`.
        objects: of Blender by path of their prims.
    """

    stage: Any
    objects: Mapping[str, Any]
    _lamps: dict[Path, lamp.Lamp] = field(default_factory=dict)
    _done: set[str] = field(default_factory=set)
    _taken: set[str] = field(default_factory=set)

    def put(self, prim: LuminairePrim) -> None:
        """Adds a lamp, once for a prototype, and takes its stand-ins away.

        Raises:
            PureLightError: If the bundle is missing, not valid or another one, or the lamp is
                sheared, mirrored or scaled unevenly.
        """
        Placement.of(prim.to_world, "the lamp")
        one = self._read(prim)
        home = self.stage.GetPrimAtPath(prim.path)
        if home.IsInstanceProxy():  # Blender has made what is in instances once, as prototypes.
            home = home.GetPrimInPrototype()
            if home.IsInstance() and prim.dimmer != 1:
                _tell(f"{prim.path}: its dimmer, of an instance in an instance, counts as 1")
        inner = str((home.GetPrototype() if home.IsInstance() else home).GetPath())
        own, stand_ins = self.objects.get(str(home.GetPath())), dict(self._stand_ins(prim, inner))
        if own is not None and own.instance_collection is not None:
            own[DIMMER] = prim.dimmer  # Of the instance; that of the prototype is 1.
        if inner not in self._done:
            if own is not None and own.instance_collection is None:
                self._add(one, own.users_collection, own, None, prim.dimmer)
            elif stand_ins:
                path, beside = next(iter(stand_ins.items()))
                frame, dimmer = self._frame(path, beside), prim.dimmer if own is None else 1.0
                self._add(one, beside.users_collection, beside.parent, frame, dimmer)
            elif own is not None:
                self._add(one, [own.instance_collection], None, None)
            else:
                raise PureLightError("Blender has imported nothing that shows its place")
            self._done.add(inner)
        for path, thing in stand_ins.items():
            self._taken.add(path)
            data = thing.data
            bpy.data.objects.remove(thing)
            if not data.users:
                bpy.data.batch_remove([data])

    def _add(
        self, one: lamp.Lamp, collections: Any, parent: Any, frame: Any, dimmer: float = 1.0
    ) -> None:
        collections = list(collections) or [bpy.context.collection]
        made = scene.add(one, collections[0])
        for other in collections[1:]:
            other.objects.link(made)
        made.parent = parent
        if frame is not None:
            made.matrix_basis = frame
        made[DIMMER] = dimmer

    def _read(self, prim: LuminairePrim) -> lamp.Lamp:
        path = Path(prim.bundle)
        if not path.is_absolute():
            path = Path(self.stage.GetRootLayer().realPath).parent / path
        if not prim.bundle or not path.is_file():
            raise PureLightError(f"its bundle {prim.bundle!r} cannot be found")
        if path not in self._lamps:
            self._lamps[path] = lamp.read(path)
        found = self._lamps[path]
        if prim.digest and prim.digest != found.digest:
            raise PureLightError(
                f"{path.name} is not the bundle that its USD asset was written for; "
                "export both again"
            )
        return found

    def _stand_ins(self, prim: LuminairePrim, inner: str) -> Iterator[tuple[str, Any]]:
        """Paths and objects of the fallback lights and the likeness of the exit surface.

        Arguments:
            inner: path of the prim, or of the prototype that it is an instance of.
        """
        for kind, shown in (("LIGHT", prim.fallback), ("MESH", prim.exit_surface)):
            for stand_in in shown:
                path = inner + stand_in[len(prim.path) :]
                thing = None if path in self._taken else self.objects.get(path)
                if thing is not None and thing.type == kind:
                    yield path, thing

    def _frame(self, path: str, light: Any) -> Any:
        """The lamp's own frame, beside its stand-in: in that of the stand-in's parent."""
        from mathutils import Matrix
        from pxr import UsdGeom

        local = UsdGeom.Xformable(self.stage.GetPrimAtPath(path)).GetLocalTransformation()
        return light.matrix_basis @ Matrix(local).transposed().inverted()


def _tell(text: str) -> None:
    """One line for the user: on the console, and before the window if there is one."""
    line = f"PureLight: {text}"
    print(line)
    if not bpy.app.background:
        bpy.context.window_manager.popup_menu(
            lambda menu, _: menu.layout.label(text=line), title="USD import", icon="ERROR"
        )


CLASSES = (WM_USD_purelight,)
