"""Lamps in a scene: one mesh with its materials for each bundle, an object for each instance."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np

from . import materials
from .lamp import Lamp
from .materials import DIMMER, LOOK, TINT

DIGEST, FLUX, SPHERE, PHOTOMETRY = (
    "purelight_digest", "purelight_flux", "purelight_sphere", "purelight_photometry",
)  # fmt: skip


def is_lamp(thing: Any) -> bool:
    """Whether an object is a lamp of ours."""
    return thing.type == "MESH" and DIGEST in thing.data


def lamps(scene: Any) -> list[Any]:
    """The lamps of a scene, those in instanced collections too, however deep."""
    found: dict[Any, None] = {}
    seen: set[Any] = set()
    waiting = [scene.objects]
    while waiting:
        objects = list(waiting.pop())
        found.update(dict.fromkeys(filter(is_lamp, objects)))
        inner = {o.instance_collection for o in objects if o.instance_collection} - seen
        seen |= inner
        waiting += [collection.all_objects for collection in inner]
    return list(found)


def add(lamp: Lamp, collection: Any, scale: float = 1.0) -> Any:
    """A new instance of a lamp.

    Arguments:
        collection: to put it in.
        scale: of the object: scene units in a metre.

    Raises:
        PureLightError: If its materials cannot be made; nothing is left behind then.
    """
    made = bpy.data.objects.new(lamp.name, mesh_of(lamp))
    made.scale = (scale,) * 3
    _inputs(made)
    collection.objects.link(made)
    return made


def _inputs(thing: Any) -> None:
    """Dimmer and tint of an instance, as properties that can be set and animated."""
    thing[DIMMER] = 1.0
    thing.id_properties_ui(DIMMER).update(
        min=0.0, soft_max=2.0, default=1.0, description="Factor on the lamp's light"
    )
    thing[TINT] = (1.0, 1.0, 1.0)
    thing.id_properties_ui(TINT).update(
        subtype="COLOR", min=0.0, soft_max=1.0, default=(1.0, 1.0, 1.0),
        description="A filter before the lamp",
    )  # fmt: skip


def mesh_of(lamp: Lamp) -> Any:
    """The mesh of a bundle: the one that is there, or a new one."""
    for mesh in bpy.data.meshes:
        same = mesh.get(DIGEST) == lamp.digest and mesh.library is None
        if same and len(mesh.polygons) == len(lamp.triangles):
            return mesh
    return _new_mesh(lamp)


def _new_mesh(lamp: Lamp) -> Any:
    made = Cleaner()
    try:
        slots = materials.materials(lamp)
        mesh = bpy.data.meshes.new(lamp.name)
        _fill(mesh, lamp)
        for material in slots:
            mesh.materials.append(material)
        _describe(mesh, lamp)
    except BaseException:
        made.clean()
        raise
    return mesh


def _fill(mesh: Any, lamp: Lamp) -> None:
    count = len(lamp.triangles)
    mesh.vertices.add(len(lamp.positions))
    mesh.vertices.foreach_set("co", lamp.positions.astype(np.float32).ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", lamp.triangles.astype(np.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.polygons.foreach_set("material_index", lamp.bins.of.astype(np.int32))
    mesh.update(calc_edges=True)
    mesh.shade_flat()
    look = mesh.attributes.new(LOOK, "FLOAT_COLOR", "POINT")
    colours = np.concatenate([lamp.look, np.ones((len(lamp.look), 1))], 1)
    look.data.foreach_set("color", colours.astype(np.float32).ravel())


def _describe(mesh: Any, lamp: Lamp) -> None:
    """What is needed later without the bundle. Dimmer and tint count where an object has none."""
    mesh[DIGEST] = lamp.digest
    mesh[FLUX] = lamp.flux.tolist()
    mesh[SPHERE] = [*map(float, lamp.sphere.center), float(lamp.sphere.radius)]
    mesh[DIMMER], mesh[TINT] = 1.0, (1.0, 1.0, 1.0)
    if lamp.photometry:
        text = bpy.data.texts.new(f"{lamp.name}.ies")
        text.from_string(lamp.photometry.decode("latin-1"))
        mesh[PHOTOMETRY] = text


class Cleaner:
    """Takes away what was made since, if it could not be finished."""

    KINDS = ("objects", "meshes", "materials", "node_groups", "texts", "images", "lights")

    def __init__(self) -> None:
        self._before = {kind: set(self._all(kind)) for kind in self.KINDS}

    def clean(self) -> None:
        """Removes every datablock that was not there before."""
        for kind in self.KINDS:
            blocks = self._all(kind)
            for key in blocks.keys() - self._before[kind]:
                getattr(bpy.data, kind).remove(blocks[key])

    def _all(self, kind: str) -> dict[int, Any]:
        return {block.session_uid: block for block in getattr(bpy.data, kind)}
