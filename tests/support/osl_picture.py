"""OSL in Blender's Cycles, run by a Python that has `bpy`: `python osl_picture.py WISH.json`.

The wish names the shader and its inputs, the mesh it is on, and the camera; what comes out is a
picture of the shader's output without light transport, a ray to a pixel.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

VARIABLE = "PURELIGHT_BPY_PYTHON"
EYE = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


def python() -> str | None:
    """A Python that has Blender as the module `bpy`: this one, or the one that a variable names."""
    named = os.environ.get(VARIABLE)
    return shutil.which(named) if named else (sys.executable if find_spec("bpy") else None)


def picture(wish: dict[str, Any], folder: Path) -> Any:
    """The picture [height, width, 3] of a wish, see `_render`."""
    import OpenEXR

    path = folder / "wish.json"
    path.write_text(json.dumps(wish | {"picture": str(folder / "picture.exr")}))
    program = python()
    assert program is not None
    subprocess.run([program, __file__, str(path)], check=True, capture_output=True)
    with OpenEXR.File(str(folder / "picture.exr")) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    return next(iter(channels.values()))[..., :3]


def answers(folder: Path, first: int, rows: int) -> Any:
    """What `selftest.osl` answers: three numbers of each row from `first` on, [rows, 3]."""
    corners = [[0, -5, 0], [rows, -5, 0], [rows, 5, 0], [0, 5, 0]]
    camera = [[1, 0, 0, rows / 2], [0, 1, 0, 0], [0, 0, 1, 5], [0, 0, 0, 1]]
    wish = {
        "shader": str(folder / "selftest.osl"), "output": "Answer", "row_from_x": True,
        "inputs": {"Tables": str(folder / "tables.exr"), "First": first},
        "positions": corners, "triangles": [[0, 1, 2, 3]], "to_world": EYE,
        "camera": camera, "ortho_scale": rows, "width": rows, "height": 4,
    }  # fmt: skip
    return picture(wish, folder)[0]


def _render(wish: dict[str, Any]) -> None:
    """Renders what the shader gives.

    Arguments:
        wish: `shader`: a path; `output`: its name; `inputs`: by name; `positions`, `triangles`: of
            the mesh; `to_world`: its matrix; `camera`: a matrix, `ortho_scale`, `width`, `height`;
            `row_from_x`: whether the input Row is the world's x.
    """
    found = find_spec("bpy")
    assert found is not None
    assert found.origin is not None
    for folder in Path(found.origin).parent.glob("*/python/lib/*/site-packages"):
        sys.path.append(str(folder))  # Where Blender's own Python would find oslquery.
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    import addon_utils

    addon_utils.enable("cycles")
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("lamp")
    mesh.from_pydata(wish["positions"], [], wish["triangles"])
    lamp = bpy.data.objects.new("lamp", mesh)
    lamp.matrix_world = _matrix(wish["to_world"])
    scene.collection.objects.link(lamp)
    mesh.materials.append(_material(bpy, wish))
    _camera(bpy, scene, wish)
    _settings(scene, wish)
    bpy.ops.render.render(write_still=True)


def _matrix(rows: Any) -> Any:
    import mathutils

    return mathutils.Matrix(rows)


def _material(bpy: Any, wish: dict[str, Any]) -> Any:
    material = bpy.data.materials.new("lamp")
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    shader, emission, out = (
        tree.nodes.new(f"ShaderNode{kind}") for kind in ("Script", "Emission", "OutputMaterial")
    )
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.shading_system = True
    shader.mode, shader.filepath = "EXTERNAL", wish["shader"]
    shader.update()
    for name, value in wish["inputs"].items():
        shader.inputs[name].default_value = value
    if wish.get("row_from_x"):
        geometry, apart = (
            tree.nodes.new("ShaderNodeNewGeometry"),
            tree.nodes.new("ShaderNodeSeparateXYZ"),
        )
        tree.links.new(geometry.outputs["Position"], apart.inputs[0])
        tree.links.new(apart.outputs[0], shader.inputs["Row"])
    tree.links.new(shader.outputs[wish["output"]], emission.inputs["Color"])
    tree.links.new(emission.outputs[0], out.inputs["Surface"])
    material.cycles.emission_sampling = "NONE"
    return material


def _camera(bpy: Any, scene: Any, wish: dict[str, Any]) -> None:
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale, camera.sensor_fit = "ORTHO", wish["ortho_scale"], "HORIZONTAL"
    camera.clip_start, camera.clip_end = 1e-4, 1e4
    eye = bpy.data.objects.new("camera", camera)
    eye.matrix_world = _matrix(wish["camera"])
    scene.collection.objects.link(eye)
    scene.camera = eye
    scene.world = bpy.data.worlds.new("black")


def _settings(scene: Any, wish: dict[str, Any]) -> None:
    """One ray through the middle of each pixel, and numbers as they are."""
    cycles, render = scene.cycles, scene.render
    cycles.device, cycles.samples, cycles.max_bounces = "CPU", 1, 0
    cycles.use_denoising = cycles.use_adaptive_sampling = False
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 0.01
    render.threads_mode, render.threads = "FIXED", 1
    render.resolution_x, render.resolution_y = wish["width"], wish["height"]
    render.resolution_percentage = 100
    scene.view_settings.view_transform = "Raw"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    render.filepath = wish["picture"]


if __name__ == "__main__":
    _render(json.loads(Path(sys.argv[1]).read_text()))
