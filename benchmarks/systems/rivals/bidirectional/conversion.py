"""A Mitsuba scene of the benchmark as LuxCore's properties and meshes, in a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from benchmarks.systems.rivals.bidirectional.materials import Properties, material, require_visible
from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_train.light.luminaire import shape_mesh

CAMERAS = {"PerspectiveCamera", "ThinLensCamera"}


def convert(scene: mi.Scene, folder: Path, *, seen: bool) -> None:
    """Write `scene.json`, properties and the picture's size, and `meshes.npz`.

    Arguments:
        seen: whether the camera looks at the lamp.

    Raises:
        PureLightError: something of the scene is not converted, with what it is.
    """
    properties = _camera(scene.sensors()[0])
    meshes: dict[str, np.ndarray] = {}
    made: dict[str, Properties] = {}
    for number, shape in enumerate(scene.shapes()):
        name = f"shape{number}"
        vertices, faces, normals = shape_mesh(shape)
        if shape.has_flipped_normals():
            faces = faces[:, ::-1]
            normals = None if normals is None else -normals
        for part, array in (("vertices", vertices), ("faces", faces), ("normals", normals)):
            if array is not None:
                meshes[f"{name}.{part}"] = np.asarray(array)
        made[name] = material(shape.bsdf(), shape.id()) | _emission(shape)
        properties |= {
            f"scene.objects.{name}.shape": [name], f"scene.objects.{name}.material": [name],
        }  # fmt: skip
    if seen:
        require_visible(made)
    for name, own in made.items():
        properties |= {f"scene.materials.{name}.{key}": value for key, value in own.items()}
    if len(scene.emitters()) != sum(shape.is_emitter() for shape in scene.shapes()):
        raise PureLightError("LuxCore is given area emitters only")
    width, height = (int(v) for v in scene.sensors()[0].film().size())
    text = json.dumps({"size": [width, height], "properties": properties})
    with atomic.replace_file(folder / "meshes.npz") as file:
        np.savez(file, allow_pickle=False, **meshes)
    atomic.write_bytes(folder / "scene.json", text.encode())


def _emission(shape: mi.Shape) -> Properties:
    """Radiance in W/(m² sr), which is LuxCore's own unit of an area light without a power."""
    if not shape.is_emitter():
        return {}
    found = mi.traverse(shape.emitter())
    if "radiance.value" not in found:
        raise PureLightError(f"the emitter of shape {shape.id()} is not converted for LuxCore")
    value = np.ravel(np.array(found["radiance.value"], np.float64))
    return {"emission": [float(v) for v in np.broadcast_to(value, 3)]}


def _camera(sensor: mi.Sensor) -> Properties:
    """A pinhole, or a thin lens; both have the horizontal angle of view.

    LuxCore's raster begins a row of pixels above its film, for which the window makes up.
    """
    if sensor.class_name() not in CAMERAS:
        raise PureLightError(f"a {sensor.class_name()} is not converted for LuxCore")
    found: Any = mi.traverse(sensor)
    matrix = np.array(found["to_world"].matrix, np.float64).reshape(4, 4)
    origin, ahead, up = matrix[:3, 3], matrix[:3, 2], matrix[:3, 1]
    width, height = (int(v) for v in sensor.film().size())
    lens: Properties = {}
    if "aperture_radius" in found:
        radius, focus = (
            float(np.ravel(found[k])[0]) for k in ("aperture_radius", "focus_distance")
        )
        lens = {"lensradius": [radius], "focaldistance": [focus]}
    camera: Properties = {
        "type": ["perspective"],
        "lookat.orig": origin.tolist(),
        "lookat.target": (origin + ahead / np.linalg.norm(ahead)).tolist(),
        "up": up.tolist(),
        "fieldofview": [float(np.ravel(found["x_fov"])[0])],
        "screenwindow": [-1.0, 1.0, *((row - 2) / width for row in (-height, height))],
        "cliphither": [float(found["near_clip"])],
        "autofocus.enable": [False],
        **lens,
    }
    return {f"scene.camera.{key}": value for key, value in camera.items()}
