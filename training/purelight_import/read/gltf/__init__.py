"""glTF 2.0, as .glb or .gltf."""

from __future__ import annotations

from purelight_import.read.gltf.scene import read_gltf

__all__ = ["read_gltf"]
