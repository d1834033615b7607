"""Mitsuba's scenes: shapes as Mitsuba loads them, materials as they are written."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model.frame import Frame
from purelight_import.model.lamp import Lamp, PointLight
from purelight_import.model.material import RGB, Verbatim
from purelight_import.model.mesh import Mesh
from purelight_import.read import mitsuba05, mitsuba_files, mitsuba_meshes, mitsuba_xml
from purelight_import.read.build import Builder
from purelight_import.read.mitsuba_emission import radiance
from purelight_import.read.mitsuba_load import load, scalar_mitsuba
from purelight_import.read.solids import SOLIDS

SKIES = {
    "constant", "envmap", "directional", "directionalarea", "sky", "sun", "sunsky", "timed_sunsky",
    "collimated",
}  # fmt: skip
ALL_ROUND = {"point", "spot"}
RAYS = 128  # along each side of a grid over a spot's picture


def read_mitsuba(path: Path) -> Lamp:
    """Reads the shapes, materials and emitters of a scene.

    Raises:
        PureLightError: something about it cannot be taken, with the remedy.
        ValueError: it is broken; so is RuntimeError, with Mitsuba's own words.
    """
    mi = scalar_mitsuba()
    builder = Builder()
    root = mitsuba_files.read_scene(path)
    old = mitsuba_files.version(root) < (2, 0)
    _leave_the_room(root, builder)
    if mitsuba_files.version(root)[0] < 3:
        mitsuba_files.find_files(root, ["spectrum"])  # Mitsuba's upgrade reads them.
        root = mitsuba05.upgrade(root, mi, builder.notes)
    known = mitsuba_xml.by_id(root)
    for emitter in root.findall("emitter"):
        _add_point(mitsuba_xml.resolved(emitter, known), mi, builder)
    for shape in mitsuba_xml.shapes(root, known):
        _add_shape(shape, mi, builder)
    up = mitsuba05.up_axis(mitsuba_files.parse(path)) if old else None
    frame = Frame(1.0, up or "y", unit_known=False, up_known=up is not None) if old else Frame()
    return Lamp("", tuple(builder.parts), tuple(builder.points), frame, builder.notes,
                tuple(builder.room))  # fmt: skip


def _leave_the_room(root: ET.Element, builder: Builder) -> None:
    """Takes out light from infinity, which no lamp gives."""
    for emitter in root.findall("emitter") + root.findall("luminaire"):
        kind = emitter.get("type", "")
        if kind in SKIES:
            builder.room.append(emitter.get("id") or kind)
            root.remove(emitter)


def _add_point(emitter: ET.Element, mi: Any, builder: Builder) -> None:
    """Adds a light without a shape."""
    kind = emitter.get("type", "")
    if kind not in ALL_ROUND:
        builder.notes(f"emitters of the type {kind[:40]} are left out", emitter.get("id", ""))
        return
    loaded, name = load(mi, emitter), builder.name(emitter.get("id") or kind)
    light = (_point if kind == "point" else _spot)(name, mi.traverse(loaded))
    if any(e.get("name") == "texture" for e in emitter):
        builder.notes("of a spot's picture only the mean is taken", name)
        light = replace(light, intensity=_mean_intensity(loaded, light, mi))
    builder.points.append(light)


def _point(name: str, parameters: Any) -> PointLight:
    return PointLight(name, np.array(parameters["position"], np.float64).ravel(), _rgb(parameters))


def _spot(name: str, parameters: Any) -> PointLight:
    """A spot as an even cone of its light.

    Mitsuba's falloff from beam width to cutoff is linear in the angle, so that the solid angle is
    2π(1 - m), where m is the mean of the cosine between them.
    """
    matrix = np.array(parameters["to_world"].matrix, np.float64).reshape(4, 4)
    forward = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    beam, cutoff = (np.radians(float(parameters[k])) for k in ("beam_width", "cutoff_angle"))
    mean = np.cos((cutoff + beam) / 2) * np.sinc((cutoff - beam) / (2 * np.pi))
    cone = (float(np.arccos(mean)),) * 2
    return PointLight(name, matrix[:3, 3], _rgb(parameters), forward, cone)


def _rgb(parameters: Any) -> RGB:
    value = np.array(parameters["intensity.value"], np.float64).ravel()
    r, g, b = np.broadcast_to(value, 3).tolist()
    return r, g, b


def _mean_intensity(emitter: Any, spot: PointLight, mi: Any) -> RGB:
    """Of a spot with a picture, from an even grid of its rays: W/sr over its even cone."""
    assert spot.cone is not None
    place = [(k + 0.5) / RAYS for k in range(RAYS)]
    rays = (emitter.sample_ray(0, 0.5, (u, v), (u, v)) for u in place for v in place)
    power = np.array([mi.Color3f(weight) for _, weight in rays], np.float64).mean(0)
    r, g, b = (power / (2 * np.pi * (1 - np.cos(spot.cone[1])))).tolist()
    return r, g, b


def _add_shape(shape: ET.Element, mi: Any, builder: Builder) -> None:
    """Adds a shape in its place."""
    kind = shape.get("type", "")
    mitsuba_files.find_files(shape)
    mitsuba_meshes.check(shape)
    emitter = shape.find("emitter")
    bsdf = shape.find("bsdf")
    named = shape.get("id", "")
    name = named or _stem(shape) or kind
    loaded = load(mi, _alone(shape))
    flags = loaded.bsdf().flags()
    glass = bool(flags & int(mi.BSDFFlags.Transmission)) and bool(
        flags & int(mi.BSDFFlags.NonSymmetric)
    )
    kept = [e for e in shape if e.tag == "bsdf" or e.get("name") in ("interior", "exterior")]
    material = _verbatim(kept, (bsdf.get("id", "") if bsdf is not None else "") or "", glass)
    mesh = _mesh(shape, loaded, mi, name)
    if _flag(shape, "flip_normals"):
        mesh = mesh.turned()
    emitted = None if emitter is None else radiance(mi, emitter, name, builder.notes)
    builder.add(name, mesh, material, (named,), emitted)


def _alone(shape: ET.Element) -> ET.Element:
    """A shape without its emitter, and not flipped: some shapes bake that into their place."""
    result = copy.copy(shape)
    for child in list(result):
        if child.tag == "emitter" or child.get("name") == "flip_normals":
            result.remove(child)
    result.attrib.pop("id", None)
    return result


def _mesh(shape: ET.Element, loaded: Any, mi: Any, name: str) -> Mesh:
    """The triangles of a shape, as Mitsuba places them."""
    parameters = mi.traverse(loaded)
    if "vertex_positions" in parameters:
        positions = np.array(parameters["vertex_positions"], np.float64).reshape(-1, 3)
        faces = np.array(parameters["faces"], np.uint32).reshape(-1, 3)
        normals, uv = (
            np.array(parameters[key], np.float64).reshape(-1, width) if key in parameters else None
            for key, width in (("vertex_normals", 3), ("vertex_texcoords", 2))
        )
        flat = _flag(shape, "face_normals") or normals is None or not len(normals)
        return Mesh(positions, faces, None if flat else normals,
                    uv if uv is not None and len(uv) else None)  # fmt: skip
    kind = shape.get("type", "")
    if kind not in SOLIDS or "to_world" not in parameters:
        raise PureLightError(f"shape '{name}' ({kind[:40]}) is not taken; turn it into a mesh")
    matrix = np.array(parameters["to_world"].matrix, np.float64).reshape(4, 4)
    return SOLIDS[kind]().moved(matrix)


def _flag(shape: ET.Element, name: str) -> bool:
    values = (e.get("value", "") for e in shape if e.get("name") == name)
    return any(value.strip().lower() == "true" for value in values)


def _stem(shape: ET.Element) -> str:
    """The name of a shape's file, which most exporters give a meaning."""
    path = next((e.get("value", "") for e in shape if e.get("name") == "filename"), "")
    index = next((e.get("value", "") for e in shape if e.get("name") == "shape_index"), "")
    return Path(path).stem + (f"_{index}" if index and path else "")


def _verbatim(elements: list[ET.Element], name: str, glass: bool) -> Verbatim:
    """Materials as written, and the files that they name."""
    named: list[tuple[str, str]] = []
    texts = []
    for element in elements:
        for path in mitsuba_files.named_files(element):
            if path not in [p for _, p in named]:
                named.append((Path(path).name, path))
        for inner in element.iter():
            inner.attrib.pop("id", None)
        texts.append(ET.tostring(element, encoding="unicode").strip())
    return Verbatim(name, tuple(texts), tuple(named), glass)
