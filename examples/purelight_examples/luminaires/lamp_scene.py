"""A lamp as a Mitsuba 3 scene: its parts, their materials, and the files they become."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh

from purelight_format import atomic

RGB = tuple[float, float, float]
# Linear Rec.709 colour of a 2,800 K black body, red = 1
WARM_WHITE: RGB = (1.0, 0.422, 0.108)


@dataclass(frozen=True)
class Material:
    """A Mitsuba BSDF: its plugin, number and string parameters, and colours."""

    plugin: str
    values: dict[str, float | str]
    colors: dict[str, RGB]

    def element(self) -> ET.Element:
        """The BSDF as XML."""
        bsdf = ET.Element("bsdf", type=self.plugin)
        for name, value in self.values.items():
            kind = "string" if isinstance(value, str) else "float"
            ET.SubElement(bsdf, kind, name=name, value=str(value))
        for name, color in self.colors.items():
            ET.SubElement(bsdf, "rgb", name=name, value=_text(color))
        return bsdf


CLEAR_GLASS = Material("dielectric", {"int_ior": 1.5, "ext_ior": 1.0}, {})
FROSTED_GLASS = Material(
    "roughdielectric", {"int_ior": 1.5, "ext_ior": 1.0, "distribution": "ggx", "alpha": 0.35}, {}
)
BRASS = Material(
    "roughconductor",
    {"material": "none", "distribution": "ggx", "alpha": 0.25},
    {"specular_reflectance": (0.86, 0.68, 0.33)},
)
NICKEL = Material(
    "roughconductor",
    {"material": "none", "distribution": "ggx", "alpha": 0.3},
    {"specular_reflectance": (0.66, 0.61, 0.53)},
)
TUNGSTEN = Material("diffuse", {}, {"reflectance": (0.45, 0.42, 0.4)})


@dataclass(frozen=True)
class Part:
    """One mesh of a lamp.

    Arguments:
        radiance: in W/(m² sr) per channel, of what shines.
        solid: whether the mesh is closed; otherwise it is a thin sheet.
    """

    name: str
    mesh: trimesh.Trimesh
    material: Material
    radiance: RGB | None = None
    solid: bool = True

    def element(self, filename: str) -> ET.Element:
        """The part as a Mitsuba shape; flat faces keep emission and refraction exact."""
        shape = ET.Element("shape", type="ply", id=self.name)
        ET.SubElement(shape, "string", name="filename", value=filename)
        ET.SubElement(shape, "boolean", name="face_normals", value="true")
        shape.append(self.material.element())
        if self.radiance is not None:
            emitter = ET.SubElement(shape, "emitter", type="area")
            ET.SubElement(emitter, "rgb", name="radiance", value=_text(self.radiance))
        return shape


def matt(name: str, mesh: trimesh.Trimesh, reflectance: RGB) -> Part:
    """A part that reflects light evenly."""
    return Part(name, mesh, Material("diffuse", {}, {"reflectance": reflectance}))


def emitted_flux(parts: Sequence[Part]) -> RGB:
    """Power the emitters send out before any glass, pi * area * radiance, in W per channel."""
    total = np.zeros(3)
    for part in parts:
        if part.radiance is not None:
            total += np.pi * part.mesh.area * np.array(part.radiance)
    r, g, b = total.tolist()
    return r, g, b


def write_scene(folder: Path, name: str, parts: Sequence[Part]) -> Path:
    """Write `<name>.xml` and its meshes into the folder; returns the XML's path."""
    scene = ET.Element("scene", version="3.0.0")
    scene.extend(write_parts(folder, name, parts))
    return write_xml(folder / f"{name}.xml", scene)


def write_parts(folder: Path, name: str, parts: Sequence[Part]) -> list[ET.Element]:
    """Write `meshes/<name>_<part>.ply` into the folder; returns the shapes that name them."""
    (folder / "meshes").mkdir(parents=True, exist_ok=True)
    shapes = []
    for part in parts:
        filename = f"meshes/{name}_{part.name}.ply"
        mesh = part.mesh.export(file_type="ply", vertex_normal=False)
        atomic.write_bytes(folder / filename, mesh)
        shapes.append(part.element(filename))
    return shapes


def write_xml(path: Path, scene: ET.Element) -> Path:
    """Write a scene as indented XML; returns its path."""
    ET.indent(scene)
    atomic.write_bytes(path, ET.tostring(scene, encoding="utf-8") + b"\n")
    return path


def _text(values: Sequence[float]) -> str:
    return ", ".join(f"{v:.6g}" for v in values)
