"""glTF written by hand, with what a test wants to be odd about it."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

from tests.support.lamp_files.model import Piece, y_up

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
LUMENS_PER_WATT = 683.0


class Glb:
    """A file that grows."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [],
        }  # fmt: skip
        self.data = b""

    def view(self, data: bytes, **more: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        at = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data)}
        self.data += data
        self.json["bufferViews"].append(at | more)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, values: Any, kind: str = "f4", **more: Any) -> int:
        array = np.ascontiguousarray(values, np.dtype(f"<{kind}"))
        array = array.reshape(len(array), -1)
        about = {
            "bufferView": self.view(array.tobytes()), "componentType": COMPONENTS[kind],
            "count": len(array), "type": TYPES[array.shape[1]],
        }  # fmt: skip
        self.json["accessors"].append(about | more)
        return len(self.json["accessors"]) - 1

    def image(self, png: bytes) -> int:
        """A picture within the file, as a texture."""
        view = self.view(png)
        self.json.setdefault("images", []).append({"bufferView": view, "mimeType": "image/png"})
        self.json.setdefault("textures", []).append({"source": len(self.json["images"]) - 1})
        return len(self.json["textures"]) - 1

    def material(self, **about: Any) -> int:
        self.json["materials"].append(about)
        return len(self.json["materials"]) - 1

    def mesh(self, name: str, positions: Any, triangles: Any, material: int | None = None,
             **attributes: int) -> int:  # fmt: skip
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": self.accessor(positions), **attributes},
            "indices": self.accessor(np.ravel(triangles), "u4"),
        }
        if material is not None:
            primitive["material"] = material
        self.json["meshes"].append({"name": name, "primitives": [primitive]})
        return len(self.json["meshes"]) - 1

    def node(self, parent: int | None = None, **about: Any) -> int:
        self.json["nodes"].append(about)
        index = len(self.json["nodes"]) - 1
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def light(self, name: str, at: Any, kind: str = "point", intensity: float = 100.0,
              **more: Any) -> int:  # fmt: skip
        extensions = self.json.setdefault("extensions", {})
        lights = extensions.setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"type": kind, "name": name, "intensity": intensity} | more)
        reference = {"KHR_lights_punctual": {"light": len(lights) - 1}}
        return self.node(name=name, translation=list(at), extensions=reference)

    def bytes(self) -> bytes:
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps({k: v for k, v in self.json.items() if v != []}).encode()
        text += b" " * (-len(text) % 4)
        data = self.data + b"\0" * (-len(self.data) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(data), 0x004E4942) + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks

    def write(self, path: Path) -> Path:
        path.write_bytes(self.bytes())
        return path


def material(piece: Piece) -> dict[str, Any]:
    """A piece's material in glTF's words, its emission in cd/m²."""
    words = piece.words
    about: dict[str, Any] = {
        "name": piece.material,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*words["base"], 1.0],
            "metallicFactor": words.get("metallic", 0.0),
            "roughnessFactor": words.get("roughness", 1.0),
        },
    }
    extensions: dict[str, Any] = {}
    if words.get("transmission"):
        extensions["KHR_materials_transmission"] = {"transmissionFactor": words["transmission"]}
        extensions["KHR_materials_ior"] = {"ior": words["ior"]}
        extensions["KHR_materials_volume"] = {"thicknessFactor": 0.005}
    if piece.radiance is not None:
        nits = LUMENS_PER_WATT * np.array(piece.radiance)
        about["emissiveFactor"] = (nits / nits.max()).tolist()
        extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": float(nits.max())}
    return about | ({"extensions": extensions} if extensions else {})


def of(pieces: list[Piece]) -> Glb:
    """Pieces as a file, +Y up as glTF has it."""
    made = Glb()
    for piece in pieces:
        index = made.material(**material(piece))
        mesh = made.mesh(piece.name, y_up(piece.mesh.vertices), piece.mesh.faces, index)
        made.node(name=piece.name, mesh=mesh)
    return made


def write(folder: Path, pieces: list[Piece], name: str = "shelf_light.glb") -> Path:
    return of(pieces).write(folder / name)
