"""Wavefront OBJ with its material libraries.

trimesh's reader is not used: it knows one library, counts relative indices from the end of the
file, and forgets the names of materials that it does not find.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from purelight_format import files
from purelight_format.errors import PureLightError
from purelight_import.model import limits
from purelight_import.model.frame import Frame
from purelight_import.model.lamp import Lamp
from purelight_import.model.material import Material
from purelight_import.model.mesh import Mesh
from purelight_import.read.beside import gathered
from purelight_import.read.build import Builder
from purelight_import.read.mtl import Library, read_mtl
from purelight_mitsuba.usd_scene.cutting import cut

Key = tuple[str, str, str]  # object, group, material


@dataclass
class _Faces:
    """Corners of the faces of one part, as indices of position, texture and normal."""

    corners: list[tuple[int, int, int]] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)


@dataclass
class _Reading:
    """What has been read of a file so far."""

    path: Path
    builder: Builder
    values: dict[str, list[list[float]]] = field(
        default_factory=lambda: {"v": [], "vt": [], "vn": []}
    )
    faces: dict[Key, _Faces] = field(default_factory=dict)
    library: Library = field(default_factory=dict)
    current: list[str] = field(default_factory=lambda: ["", "", ""])
    title: str = ""
    blender: bool = False

    def line(self, key: str, rest: str) -> None:
        """Takes one statement."""
        if key in self.values:
            self.values[key].append([float(x) for x in rest.split()[:3]])
        elif key == "f":
            self._face(rest.split())
        elif key in ("o", "g", "usemtl"):
            self._enter(key, rest)
        elif key == "mtllib":
            self._load(rest)
        elif key in ("l", "p", "curv", "surf"):
            self.builder.notes("points, lines and curves are left out", self.current[0])

    def _enter(self, key: str, name: str) -> None:
        self.current[("o", "g", "usemtl").index(key)] = name
        if key == "o":
            self.current[1] = ""
            self.title = self.title or name

    def _face(self, words: list[str]) -> None:
        if len(words) < 3:
            return
        self.builder.count(len(words) - 2)
        key: Key = (self.current[0], self.current[1], self.current[2])
        part = self.faces.setdefault(key, _Faces())
        part.corners += [self._corner(word) for word in words]
        part.counts.append(len(words))

    def _corner(self, word: str) -> tuple[int, int, int]:
        """Indices of one corner; those below zero count back from the last one read."""
        result = []
        for text, kind in zip([*word.split("/"), "", ""][:3], ("v", "vt", "vn"), strict=True):
            index = int(text) if text else 0
            if index < 0:
                index += len(self.values[kind]) + 1
            if index <= 0 and kind == "v":
                raise ValueError(f"a face names vertex '{text}'")
            result.append(max(index, 0) - 1)
        return result[0], result[1], result[2]

    def _load(self, rest: str) -> None:
        """Reads a material library, or several of them; names may have spaces."""
        try:
            path = gathered(self.path.parent, rest, self.builder.notes)
            self.library |= read_mtl(path, self.builder.notes, blender=self.blender)
        except PureLightError:
            for name in rest.split():
                try:
                    path = gathered(self.path.parent, name, self.builder.notes)
                except PureLightError as error:
                    self.builder.notes(f"materials are missing: {error}")
                    continue
                self.library |= read_mtl(path, self.builder.notes, blender=self.blender)


def read_obj(path: Path) -> Lamp:
    """Reads a file's faces as one part for each object, group and material.

    Raises:
        PureLightError: something about it cannot be taken, with the remedy.
        ValueError: it is broken.
    """
    data = files.read_file(path, limits.FILE_BYTES)
    if b"\0" in data[:4096]:
        raise ValueError("it is no text")
    reading = _Reading(path, Builder())
    for key, rest in _statements(data):
        if key == "#":
            reading.blender = reading.blender or "Blender" in rest
        else:
            reading.line(key, rest)
    arrays = {
        kind: _array(values, 2 if kind == "vt" else 3) for kind, values in reading.values.items()
    }
    for place, faces in reading.faces.items():
        _add(reading, place, faces, arrays)
    frame = Frame(1.0, "y", unit_known=False, up_known=False)
    return Lamp("", tuple(reading.builder.parts), (), frame, reading.builder.notes)


def _statements(data: bytes) -> Iterator[tuple[str, str]]:
    """Key and rest of each line; a backslash joins lines."""
    text = data.decode("utf-8-sig", errors="replace").replace("\\\r\n", " ").replace("\\\n", " ")
    for line in text.splitlines():
        line = line.strip()
        if line.startswith("#"):
            yield "#", line[:200]
            continue
        key, rest = [*line.split(None, 1), "", ""][:2]
        if key:
            yield key, rest.partition("#")[0].strip() if key in ("v", "vt", "vn", "f") else rest


def _array(values: list[list[float]], width: int) -> NDArray[np.float64]:
    """Values [N, width]; those that are missing are zero."""
    if all(len(v) >= width for v in values):
        return np.array([v[:width] for v in values], np.float64).reshape(-1, width)
    padded = [(v + [0.0] * width)[:width] for v in values]
    return np.array(padded, np.float64).reshape(-1, width)


def _add(
    reading: _Reading, key: Key, faces: _Faces, arrays: dict[str, NDArray[np.float64]]
) -> None:
    """Adds one part: its polygons cut into triangles."""
    name, group, material_name = key
    corners = np.array(faces.corners, np.int64)
    unique, index = np.unique(corners, axis=0, return_inverse=True)
    if len(unique) and unique[:, 0].max() >= len(arrays["v"]):
        raise ValueError("a face names vertices that are not there")
    _, three = cut(np.array(faces.counts), corners[:, 0], arrays["v"])
    triangles = index.reshape(-1)[three]
    uv = _picked(arrays["vt"], unique[:, 1])
    if uv is not None:
        uv[:, 1] = 1 - uv[:, 1]  # The origin of OBJ's is the lower left corner.
    mesh = Mesh(arrays["v"][unique[:, 0]], triangles.astype(np.uint32),
                _picked(arrays["vn"], unique[:, 2]), uv)  # fmt: skip
    found = reading.library.get(material_name)
    if found is None and material_name:
        reading.builder.notes("materials that no library describes are matt", material_name)
    material, radiance = found or (Material(material_name, roughness=1.0, specular=0.0), None)
    shown = next(filter(None, (name, group if group != "default" else "", material_name)), "")
    reading.builder.add(shown, mesh, material, (name, group), radiance)


def _picked(values: NDArray[np.float64], index: NDArray[np.int64]) -> NDArray[np.float64] | None:
    """Rows of values; None where any is missing."""
    if not len(index) or index.min() < 0 or index.max() >= len(values):
        return None
    return values[index].copy()
