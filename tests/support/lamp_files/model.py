"""A lamp to write: a bulb in a glass shell on a brass base, in metres with +Z up."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import trimesh

RADIANCE = (300.0, 200.0, 100.0)
GLASS_OUTER, GLASS_INNER, BULB = 0.06, 0.055, 0.02


@dataclass(frozen=True)
class Piece:
    """A mesh and its material, in the words of `purelight_import.model.material`."""

    name: str
    mesh: trimesh.Trimesh
    material: str
    words: dict[str, Any] = field(default_factory=dict)
    radiance: tuple[float, float, float] | None = None


def ball(radius: float, subdivisions: int = 3) -> trimesh.Trimesh:
    return trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)


def shell(outer: float = GLASS_OUTER, inner: float = GLASS_INNER) -> trimesh.Trimesh:
    """A closed wall between two balls."""
    hollow = ball(inner)
    hollow.invert()
    return trimesh.util.concatenate([ball(outer), hollow])


def box(size: tuple[float, float, float], at: tuple[float, float, float]) -> trimesh.Trimesh:
    made = trimesh.creation.box(extents=size)
    made.apply_translation(at)
    return made


def bulb() -> Piece:
    return Piece("Bulb", ball(BULB), "Glow", {"base": (0.0, 0.0, 0.0)}, RADIANCE)


def globe(mesh: trimesh.Trimesh | None = None, name: str = "Globe") -> Piece:
    words = {"transmission": 1.0, "ior": 1.5, "roughness": 0.0, "base": (1.0, 1.0, 1.0)}
    return Piece(name, mesh if mesh is not None else shell(), "Clear glass", words)


def base() -> Piece:
    words = {"base": (0.8, 0.6, 0.3), "metallic": 1.0, "roughness": 0.4}
    return Piece("Base", box((0.05, 0.05, 0.02), (0.0, 0.0, 0.08)), "Brass", words)


def lamp() -> list[Piece]:
    """Bulb, globe and base: the base stands on top, so that up and down differ."""
    return [bulb(), globe(), base()]


def y_up(points: np.ndarray) -> np.ndarray:
    """Places in metres with +Z up, as a file with +Y up has them."""
    return np.asarray(points) @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
