"""A lamp as a Mitsuba scene with its meshes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from purelight_format.color import lumens
from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.material import Verbatim
from purelight_import.model.mesh import Mesh
from purelight_import.model.names import Names, tidy
from purelight_import.model.picture import Picture
from purelight_import.parts.emitters import flux
from purelight_import.write import bsdf, xml
from purelight_import.write.textures import Textures

VERSION = "3.0.0"
MESHES = "meshes"
WORDS = "metres, +Z up; light in watts per linear Rec.709 channel"


def write_scene(path: Path, lamp: Lamp, parts: Sequence[Part], source: str) -> None:
    """Writes parts as a scene file, with meshes and pictures beside it.

    Arguments:
        path: of the file, in a folder that nobody else uses.
        source: what it was made from, for a comment.
    """
    root = ET.Element("scene", version=VERSION)
    root.append(xml.comment(f"{lamp.name}, by purelight-import from {source}; {WORDS}"))
    writer = _Writer(path.parent, {part.name.lower() for part in parts})
    shapes = [writer.shape(part) for part in parts]
    root.extend(writer.shared)
    for comment, shape in shapes:
        root.append(comment)
        root.append(shape)
    ET.indent(root, "  ")
    path.write_bytes(ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


@dataclass
class _Writer:
    """Writes parts; materials that several share are written once.

    Arguments:
        parts: names of all parts, in lower case: the identifiers of the shapes.
    """

    folder: Path
    parts: set[str]
    textures: Textures = field(init=False)
    shared: list[ET.Element] = field(default_factory=list)
    made: dict[tuple[int, bool], list[ET.Element]] = field(default_factory=dict)
    files: Names = field(default_factory=Names)
    materials: Names = field(init=False)

    def __post_init__(self) -> None:
        self.materials = Names(set(self.parts))
        self.textures = Textures(self.folder)
        (self.folder / MESHES).mkdir(exist_ok=True)

    def shape(self, part: Part) -> tuple[ET.Element, ET.Element]:
        """A comment about a part, and its shape."""
        flat = part.mesh.normals is None or part.radiance is not None
        filename = f"{MESHES}/{self._name(part.name)}.ply"
        write_ply(self.folder / filename, part.mesh, flat=flat)
        shape = ET.Element("shape", type="ply", id=part.name)
        xml.text(shape, "filename", filename)
        if flat:
            xml.flag(shape, "face_normals", value=True)
        shape.extend(self._material(part))
        about = part.material.name or "as in the file"
        if part.radiance is not None:
            emitter = ET.SubElement(shape, "emitter", type="area")
            if isinstance(part.radiance, Picture):
                emitter.append(self.textures.element(part.radiance, "radiance", radiance=True))
            else:
                xml.color(emitter, "radiance", part.radiance)
            about += f", emits {lumens(flux(part, part.radiance)):.4g} lm"
        return xml.comment(f"{part.name}: {about}"), shape

    def _name(self, wanted: str) -> str:
        return self.files.fresh(tidy(wanted) or "part")

    def _material(self, part: Part) -> list[ET.Element]:
        """References to a part's material and medium."""
        key = id(part.material), part.solid
        if key not in self.made:
            found = self._elements(part)
            self.made[key] = [self._share(element, part) for element in found]
        return [ET.Element("ref", e.attrib) for e in self.made[key]]

    def _elements(self, part: Part) -> list[ET.Element]:
        if not isinstance(part.material, Verbatim):
            return bsdf.elements(part.material, self.textures, solid=part.solid)
        found = [ET.fromstring(text) for text in part.material.elements]
        files = {path: self.textures.copy(path, name) for name, path in part.material.files}
        for key in ("value", "filename"):
            for inner in (e for element in found for e in element.iter() if e.get(key) in files):
                inner.set(key, files[inner.attrib[key]])
        return found

    def _share(self, element: ET.Element, part: Part) -> ET.Element:
        """Puts a material before the shapes; returns the attributes of a reference to it."""
        named = element.attrib.pop("name", None)
        name = tidy(part.material.name) or f"{part.name}_material"
        medium = element.tag == "medium"
        identifier = self._unique(f"{name}_{named or 'medium'}" if medium else name)
        element.set("id", identifier)
        self.shared.append(element)
        return ET.Element("ref", {"id": identifier} | ({"name": named} if medium and named else {}))

    def _unique(self, base: str) -> str:
        return self.materials.fresh(f"{base}_bsdf" if base.lower() in self.parts else base)


def write_ply(path: Path, mesh: Mesh, *, flat: bool) -> None:
    """Writes a mesh as binary PLY: positions, normals unless flat, texture coordinates."""
    columns, names = [mesh.positions], ["x", "y", "z"]
    if mesh.normals is not None and not flat:
        columns.append(mesh.normals)
        names += ["nx", "ny", "nz"]
    if mesh.uv is not None:
        columns.append(mesh.uv)
        names += ["u", "v"]
    faces = np.empty(len(mesh.triangles), [("count", "u1"), ("index", "<i4", 3)])
    faces["count"], faces["index"] = 3, mesh.triangles
    header = [
        "ply", "format binary_little_endian 1.0", f"element vertex {len(mesh.positions)}",
        *(f"property float {name}" for name in names), f"element face {len(faces)}",
        "property list uchar int vertex_indices", "end_header\n",
    ]  # fmt: skip
    data = np.concatenate(columns, 1).astype("<f4")
    path.write_bytes("\n".join(header).encode() + data.tobytes() + faces.tobytes())
