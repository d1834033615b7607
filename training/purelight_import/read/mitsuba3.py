"""Mitsuba's scenes: shapes as Mitsuba loads them, materials as they are written."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_import.model.color import KELVIN, black_body
from purelight_import.model.frame import Frame
from purelight_import.model.lamp import Lamp, PointLight
from purelight_import.model.material import RGB, Color, Verbatim
from purelight_import.model.mesh import Mesh
from purelight_import.model.picture import Picture
from purelight_import.read import images, mitsuba05, mitsuba_meshes, mitsuba_xml
from purelight_import.read.build import Builder
from purelight_import.read.solids import SOLIDS
from purelight_mitsuba.platform import reading

SKIES = {
    "constant", "envmap", "directional", "directionalarea", "sky", "sun", "sunsky", "timed_sunsky",
    "collimated",
}  # fmt: skip
ALL_ROUND = {"point", "spot"}


def read_mitsuba(path: Path) -> Lamp:
    """Reads the shapes, materials and emitters of a scene.

    Raises:
        PureLightError: something about it cannot be taken, with the remedy.
        ValueError: it is broken; so is RuntimeError, with Mitsuba's own words.
    """
    mi = _mitsuba()
    builder = Builder()
    root = mitsuba_xml.read_scene(path)
    old = mitsuba_xml.version(root) < (2, 0)
    _leave_the_room(root, builder)
    if mitsuba_xml.version(root)[0] < 3:
        root = mitsuba05.upgrade(root, mi, builder.notes)
    known = mitsuba_xml.by_id(root)
    for emitter in root.findall("emitter"):
        _add_point(mitsuba_xml.resolved(emitter, known), mi, builder)
    for shape in mitsuba_xml.shapes(root, known):
        _add_shape(shape, mi, builder)
    up = mitsuba05.up_axis(mitsuba_xml.parse(path)) if old else None
    frame = Frame(1.0, up or "y", unit_known=False, up_known=up is not None) if old else Frame()
    return Lamp("", tuple(builder.parts), tuple(builder.points), frame, builder.notes,
                tuple(builder.room))  # fmt: skip


def _mitsuba() -> Any:
    """Mitsuba without a just-in-time compiler, which reading does not need."""
    from purelight_mitsuba import platform

    platform.prepare()
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    return mi


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
    loaded = _load(mi, emitter)
    parameters = mi.traverse(loaded)
    if kind == "point":
        at, forward, cone = np.array(parameters["position"]).ravel(), np.array([0.0, 0, -1]), None
    else:
        matrix = np.array(parameters["to_world"].matrix, np.float64).reshape(4, 4)
        at, forward = matrix[:3, 3], matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        angles = (float(parameters["beam_width"]), float(parameters["cutoff_angle"]))
        cone = (min(np.radians(angles)), max(np.radians(angles)))
    value = np.broadcast_to(np.array(parameters["intensity.value"], np.float64).ravel(), 3)
    r, g, b = value.tolist()
    name = builder.name(emitter.get("id") or kind)
    builder.points.append(PointLight(name, at.astype(np.float64), (r, g, b), forward, cone))


def _add_shape(shape: ET.Element, mi: Any, builder: Builder) -> None:
    """Adds a shape in its place."""
    kind = shape.get("type", "")
    mitsuba_xml.find_files(shape)
    mitsuba_meshes.check(shape)
    emitter = shape.find("emitter")
    bsdf = shape.find("bsdf")
    named = shape.get("id", "")
    name = named or _stem(shape) or kind
    loaded = _load(mi, _alone(shape))
    flags = loaded.bsdf().flags()
    glass = bool(flags & int(mi.BSDFFlags.Transmission)) and bool(
        flags & int(mi.BSDFFlags.NonSymmetric)
    )
    kept = [e for e in shape if e.tag == "bsdf" or e.get("name") in ("interior", "exterior")]
    material = _verbatim(kept, (bsdf.get("id", "") if bsdf is not None else "") or "", glass)
    mesh = _mesh(shape, loaded, mi, name)
    if _flag(shape, "flip_normals"):
        mesh = mesh.turned()
    radiance = None if emitter is None else _radiance(emitter, name, builder)
    builder.add(name, mesh, material, (named,), radiance)


def _alone(shape: ET.Element) -> ET.Element:
    """A shape without its emitter."""
    result = copy.copy(shape)
    for emitter in result.findall("emitter"):
        result.remove(emitter)
    result.attrib.pop("id", None)
    return result


def _load(mi: Any, element: ET.Element) -> Any:
    """An object of Mitsuba's."""
    mitsuba_xml.find_files(element)
    scene = ET.Element("scene", version="3.0.0")
    scene.append(element)
    loaded = mi.load_string(ET.tostring(scene, encoding="unicode"), parallel=False, optimize=False)
    return (loaded.shapes() or loaded.emitters())[0]


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
    return any(e.get("name") == name and e.get("value") == "true" for e in shape)


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
        for string in element.iter("string"):
            path = string.get("value", "")
            if string.get("name") == "filename" and path not in [p for _, p in named]:
                named.append((Path(path).name, path))
        for inner in element.iter():
            inner.attrib.pop("id", None)
        texts.append(ET.tostring(element, encoding="unicode").strip())
    return Verbatim(name, tuple(texts), tuple(named), glass)


def _radiance(emitter: ET.Element, name: str, builder: Builder) -> Color | None:
    """Radiance of an area emitter."""
    if emitter.get("type") != "area":
        kind = emitter.get("type", "")[:40]
        builder.notes(f"{kind} emitters are taken as even ones (area)", name)
    value = next((e for e in emitter if e.get("name") == "radiance"), None)
    if value is None:
        return 1.0, 1.0, 1.0
    if value.tag == "texture":
        return _texture(value)
    color = _color(value, builder)
    return color if max(color) > 0 else None


def _color(value: ET.Element, builder: Builder) -> RGB:
    if value.get("type") == "blackbody":
        kelvin = next((float(e.get("value", 0)) for e in value if e.get("name") == "temperature"),
                      6500.0)  # fmt: skip
        builder.notes("black bodies are taken by their colour, not their strength; state lumens")
        return black_body(float(np.clip(kelvin, *KELVIN)))
    inner = value.find("*") if value.get("type") else None
    text = (inner if inner is not None else value).get("value", "")
    if ":" in text:
        builder.notes("spectra of emission are taken as white; give a colour temperature")
        numbers = [float(pair.split(":")[1]) for pair in text.split(",")]
        return (float(np.mean(numbers)),) * 3
    numbers = [float(x) for x in mitsuba05.SEPARATORS.split(text.strip())]
    r, g, b = numbers * 3 if len(numbers) == 1 else numbers[:3]
    return max(r, 0.0), max(g, 0.0), max(b, 0.0)


def _texture(texture: ET.Element) -> Picture:
    """A bitmap as emission."""
    values = {e.get("name"): e.get("value", "") for e in texture}
    if texture.get("type") != "bitmap" or "filename" not in values:
        raise PureLightError("emission by a texture that is no bitmap is not taken")
    path = Path(values["filename"])
    wrap = {"clamp": "clamp", "mirror": "mirror"}.get(values.get("wrap_mode", ""), "repeat")
    if path.suffix.lower() in (".exr", ".hdr", ".pfm"):
        return Picture(path.stem, _high_range(path), False, wrap)
    picture = images.load(path, srgb=values.get("raw") != "true").colors()
    return Picture(picture.name, picture.pixels, picture.srgb, wrap)


def _high_range(path: Path) -> np.ndarray:
    """Pixels of a picture with a high range: [H, W, 3] of float32."""
    import mitsuba as mi

    with reading():
        bitmap = mi.Bitmap(str(path)).convert(
            mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False
        )
    return np.array(bitmap, np.float32)
