"""Blender with the extension, run by a Python that has `bpy`: `python blender_host.py WISH.json`.

The wish is a list of steps, each the name of a function below and its arguments; what the steps
return is written as a list. `Blender.run` does so from a test.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MODULE = "bl_ext.user_default.purelight"
SECONDS = 300


@dataclass(frozen=True)
class Blender:
    """A Blender with folders of its own.

    Arguments:
        program: a Python that has `bpy`.
        folder: for its settings and extensions.
    """

    program: str
    folder: Path

    def run(self, *steps: tuple[str, dict[str, Any]], installed: bool = True) -> list[Any]:
        """What the steps return, in one new process."""
        wish, answer = self.folder / "wish.json", self.folder / "answer.json"
        first = [("enable", {})] if installed else []
        wish.write_text(json.dumps([*first, *steps]))
        answer.unlink(missing_ok=True)
        found = "from importlib.util import find_spec; print(find_spec('bpy').origin)"
        place = Path(subprocess.run([self.program, "-c", found], check=True, capture_output=True,
                                    text=True).stdout.strip()).parent  # fmt: skip
        own = [*place.glob("*/python/lib/*/site-packages"), *place.glob("*/scripts/addons_core")]
        kept = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
        environment = kept | {
            "BLENDER_USER_RESOURCES": str(self.folder / "user"), "OMP_NUM_THREADS": "1",
            "PYTHONPATH": os.pathsep.join(map(str, own)),  # Where Blender's own Python looks.
        }  # fmt: skip
        done = subprocess.run(
            [self.program, __file__, str(wish), str(answer)], env=environment, check=False,
            capture_output=True, text=True, timeout=SECONDS,
        )  # fmt: skip
        assert answer.exists(), done.stdout[-2000:] + done.stderr[-4000:]
        (self.folder / "said.txt").write_text(done.stdout)
        results: list[Any] = json.loads(answer.read_text())
        return results[len(first) :]

    def said(self) -> list[str]:
        """The lines that the user was told in the last run."""
        return (self.folder / "said.txt").read_text().splitlines()


# What follows runs in Blender.


def install(path: str) -> list[str]:
    """Installs the zip as a user does."""
    import bpy

    bpy.ops.extensions.package_install_files(
        filepath=path, repo="user_default", enable_on_install=True
    )
    return [m for m in sys.modules if m.split(".")[0] in ("onnx", "onnxruntime", "OpenEXR")]


def enable() -> None:
    """Switches the extension on, and waits for nothing else."""
    import bpy  # noqa: F401  (before any of its modules)

    import addon_utils  # isort: skip

    addon_utils.extensions_refresh(ensure_wheels=True)
    assert addon_utils.enable(MODULE) is not None


def disable() -> list[str]:
    """Switches it off again; what of it is left in Blender."""
    import bpy

    import addon_utils  # isort: skip

    addon_utils.disable(MODULE)
    handlers = [call for calls in vars_of(bpy.app.handlers) for call in calls]
    left = [str(h) for h in handlers if MODULE in getattr(h, "__module__", "")]
    return left + [name for name in dir(bpy.types) if "purelight" in name.lower()]


def vars_of(handlers: Any) -> list[list[Any]]:
    return [getattr(handlers, n) for n in dir(handlers) if isinstance(getattr(handlers, n), list)]


def empty(
    engine: str = "CYCLES", scale_length: float = 1.0, background: float = 0.0, ours: bool = True
) -> None:
    """A new file of nothing, under an even sky; with the extension, or without."""
    import bpy

    import addon_utils  # isort: skip

    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon_utils.enable("cycles")
    if ours:
        addon_utils.extensions_refresh(ensure_wheels=True)
        addon_utils.enable(MODULE)
    else:
        addon_utils.disable(MODULE)
    scene = bpy.context.scene
    scene.render.engine = engine
    scene.unit_settings.scale_length = scale_length
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    world.node_tree.nodes["Background"].inputs["Strength"].default_value = background
    scene.world = world


def plux(path: str, **options: Any) -> list[str]:
    """Imports; returns FINISHED or the error that the user sees."""
    import bpy

    try:
        return sorted(bpy.ops.import_scene.plux(filepath=path, **options))
    except RuntimeError as error:
        return [str(error)]


def usd(path: str) -> list[str]:
    """Blender's own USD importer."""
    import bpy

    return sorted(bpy.ops.wm.usd_import(filepath=path))


def counts() -> dict[str, int]:
    """Datablocks by kind."""
    import bpy

    kinds = ("objects", "meshes", "materials", "node_groups", "texts", "images", "lights")
    return {kind: len(getattr(bpy.data, kind)) for kind in kinds}


def objects() -> list[dict[str, Any]]:
    """What is in the file."""
    import bpy

    bpy.context.view_layer.update()
    return [
        {
            "name": thing.name, "type": thing.type, "mesh": thing.data and thing.data.name,
            "parent": thing.parent and thing.parent.name,
            "world": [list(row) for row in thing.matrix_world],
            "size": list(thing.dimensions), "dimmer": thing.get("purelight_dimmer"),
            "state": thing.get("purelight_state"), "shadow": thing.visible_shadow,
            "energy": getattr(thing.data, "energy", None) if thing.type == "LIGHT" else None,
            "color": list(thing.data.color) if thing.type == "LIGHT" else None,
        }
        for thing in bpy.data.objects
    ]  # fmt: skip


def place(name: str, world: Any) -> None:
    """Puts an object somewhere."""
    import bpy
    from mathutils import Matrix

    bpy.data.objects[name].matrix_world = Matrix(world)


def dim(name: str, dimmer: float, tint: Any = (1, 1, 1)) -> None:
    """Sets the inputs of a lamp, or of what instances one."""
    import bpy

    bpy.data.objects[name]["purelight_dimmer"] = dimmer
    bpy.data.objects[name]["purelight_tint"] = tint


def floor(z: float, size: float) -> None:
    """A matt floor of reflectance 0.5."""
    import bpy

    bpy.ops.mesh.primitive_plane_add(size=size, location=(0, 0, z))
    bpy.context.object.data.materials.append(_matt(0.5))


def _matt(reflectance: float) -> Any:
    import bpy

    material = bpy.data.materials.new("matt")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    matt, out = (tree.nodes.new(f"ShaderNode{k}") for k in ("BsdfDiffuse", "OutputMaterial"))
    matt.inputs["Color"].default_value = (*(3 * (reflectance,)), 1)
    tree.links.new(matt.outputs[0], out.inputs[0])
    return material


def box(world: Any, reflectance: float) -> None:
    """A matt cube of edge 2, placed by a matrix; rays may be inside of it."""
    import bpy
    from mathutils import Matrix

    bpy.ops.mesh.primitive_cube_add(size=2)
    bpy.context.object.matrix_world = Matrix(world)
    bpy.context.object.data.materials.append(_matt(reflectance))


def plain(strength: float) -> None:
    """Lets the first lamp shine evenly, by Blender's own emission."""
    import bpy

    mesh = next(mesh for mesh in bpy.data.meshes if "purelight_digest" in mesh)
    for material in mesh.materials:
        tree = material.node_tree
        out = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL" and n.target == "CYCLES")
        emission = tree.nodes.new("ShaderNodeEmission")
        emission.inputs["Strength"].default_value = strength
        tree.links.new(emission.outputs[0], out.inputs["Surface"])


def picture(
    path: str,
    camera: Any,
    size: float,
    pixels: int,
    samples: int = 1,
    osl: bool = True,
    bounces: int = 0,
    seed: int = 0,
    fov: float = 0.0,
) -> float:
    """Renders, numbers as they are; one sample is mid-pixel. Returns seconds of the processor.

    Arguments:
        size: of what an orthographic camera sees; with a field of view in degrees, it is a
            perspective one.
    """
    import time

    import bpy
    from mathutils import Matrix

    scene = bpy.context.scene
    seen = bpy.data.objects.new("eye", bpy.data.cameras.new("eye"))
    seen.data.type, seen.data.ortho_scale = "ORTHO", size
    if fov:
        seen.data.type, seen.data.angle = "PERSP", math.radians(fov)
    seen.data.clip_start, seen.data.clip_end = 1e-4, 1e4
    seen.matrix_world = Matrix(camera)
    scene.collection.objects.link(seen)
    scene.camera = seen
    cycles, render = scene.cycles, scene.render
    cycles.shading_system = osl
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", samples, bounces
    cycles.diffuse_bounces, cycles.seed = bounces, seed
    cycles.min_transparent_bounces = 64  # No roulette.
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type = "BOX"
    cycles.filter_width = 0.01 if samples == 1 else 1.0
    render.threads_mode, render.threads = "FIXED", 1
    render.resolution_x = render.resolution_y = pixels
    render.resolution_percentage, render.film_transparent = 100, False
    scene.view_settings.view_transform = "Raw"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = path
    start = time.process_time()
    bpy.ops.render.render(write_still=True)
    seconds = time.process_time() - start
    bpy.data.cameras.remove(seen.data)
    return seconds


def collected(name: str, empty: str, location: Any) -> None:
    """Moves an object into a collection of its own, which an empty instances."""
    import bpy

    thing, scene = bpy.data.objects[name], bpy.context.scene
    inner = bpy.data.collections.new("inner")
    inner.objects.link(thing)
    for other in [c for c in thing.users_collection if c != inner]:
        other.objects.unlink(thing)
    holder = bpy.data.objects.new(empty, None)
    holder.instance_type, holder.instance_collection = "COLLECTION", inner
    holder.location = location
    scene.collection.objects.link(holder)


def adopted(name: str, scale: float) -> None:
    """Hangs an object on an empty that is scaled."""
    import bpy

    holder = bpy.data.objects.new("rig", None)
    holder.scale = (scale,) * 3
    bpy.context.scene.collection.objects.link(holder)
    bpy.data.objects[name].parent = holder


def refresh() -> list[str]:
    """Presses the panel's button; returns FINISHED or the error that the user sees."""
    import bpy

    try:
        return sorted(bpy.ops.object.purelight_refresh())
    except RuntimeError as error:
        return [str(error)]


def linked(path: str, name: str) -> None:
    """Puts an object of another file into the scene, as it is there."""
    import bpy

    with bpy.data.libraries.load(path, link=True) as (_, wanted):
        wanted.objects = [name]
    bpy.context.scene.collection.objects.link(bpy.data.objects[name])


def forged(key: str, table: str) -> None:
    """Writes other tables' names into the images and scripts."""
    import bpy

    for image in bpy.data.images:
        if "purelight_tables" in image:
            image["purelight_tables"] = key or image["purelight_tables"]
    for group in bpy.data.node_groups:
        for node in group.nodes:
            if node.type == "SCRIPT":
                node.inputs["Tables"].default_value = table


def rename() -> None:
    """Gives everything other names, as a tidy user does."""
    import bpy

    for kind in ("objects", "meshes", "materials", "node_groups", "texts", "images"):
        for number, block in enumerate(list(getattr(bpy.data, kind))):
            block.name = f"Größe {number}"


def drop(name: str) -> None:
    """Takes an object away."""
    import bpy

    bpy.data.objects.remove(bpy.data.objects[name])


def engine(name: str) -> None:
    """Chooses another renderer."""
    import bpy

    bpy.context.scene.render.engine = name


def save(path: str) -> None:
    import bpy

    bpy.ops.wm.save_as_mainfile(filepath=path)


def load(path: str) -> None:
    import bpy

    bpy.ops.wm.open_mainfile(filepath=path)


def tables() -> list[str]:
    """Paths of the tables that scripts read."""
    import bpy

    nodes = [n for g in bpy.data.node_groups for n in g.nodes if n.type == "SCRIPT"]
    return [n.inputs["Tables"].default_value for n in nodes]


def undo_and_redo(path: str) -> list[int]:
    """Objects before an import, after it, after it is undone, and after it is done again."""
    import bpy

    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    found = []
    with bpy.context.temp_override(window=window, screen=window.screen, area=area):
        bpy.ops.ed.undo_push(message="before")
        found.append(len(bpy.data.objects))
        bpy.ops.import_scene.plux(filepath=path)
        bpy.ops.ed.undo_push(message="import")
        found.append(len(bpy.data.objects))
        for step in (bpy.ops.ed.undo, bpy.ops.ed.redo):
            step()
            found.append(len(bpy.data.objects))
    return found


def main() -> None:
    """Does what the wish says."""
    steps = json.loads(Path(sys.argv[1]).read_text())
    results = [globals()[name](**arguments) for name, arguments in steps]
    Path(sys.argv[2]).write_text(json.dumps(results))


if __name__ == "__main__":
    main()
