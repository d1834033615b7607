"""A lamp of the zoo: its parts, its place and size, and the files it becomes."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from benchmarks.zoo.lamps import textures
from benchmarks.zoo.lamps.draw import Draw
from benchmarks.zoo.lamps.families import FAMILIES
from benchmarks.zoo.lamps.forms import Mesh
from benchmarks.zoo.lamps.outside import self_view
from benchmarks.zoo.lamps.pieces import Light, Part, Piece
from benchmarks.zoo.lamps.placement import Placement, turn
from benchmarks.zoo.lamps.ply import ply
from purelight_examples.luminaires.lamp_scene import write_xml
from purelight_format import atomic

SIZES = ((0.002, 0.02, 0.15), (0.03, 0.5, 0.55), (0.5, 5.0, 0.2), (5.0, 30.0, 0.1))
OFFSETS = ((0.0, 0.0, 0.55), (0.5, 3.0, 0.35), (3.0, 10.0, 0.1))
FACING = 0.02  # part of its own light that makes a lamp concave


@dataclass(frozen=True)
class Lamp:
    """One lamp.

    Arguments:
        seed, index: what it was drawn from.
        parts: in unit lengths, about the origin.
        radius: of the sphere about the origin that holds them.
        placement: where and how large it is.
    """

    seed: int
    index: int
    family: str
    parts: tuple[Part, ...]
    placement: Placement

    @property
    def name(self) -> str:
        return f"{self.index:02d}-{self.family.replace(' ', '-').lower()}"

    @property
    def pieces(self) -> list[Piece]:
        """The parts that have a body."""
        return [part for part in self.parts if isinstance(part, Piece)]

    @property
    def lights(self) -> list[Light]:
        """The emitters that have none."""
        return [part for part in self.parts if isinstance(part, Light)]

    @cached_property
    def radius(self) -> float:
        """Of the sphere about the origin that holds the parts, in unit lengths."""
        return max(float(np.linalg.norm(p.triangles.vertices, axis=1).max()) for p in self.pieces)

    @property
    def traits(self) -> list[str]:
        """What the lamp is made of, in words."""
        found = set().union(*(piece.finish.traits for piece in self.pieces))
        found |= {"smooth" for p in self.pieces if isinstance(p.form, Mesh) and p.form.smooth}
        found |= {"analytic" for p in self.pieces if not isinstance(p.form, Mesh)}
        found |= {"sheet" for p in self.pieces if not p.solid and p.radiance is None}
        found |= {"point" if light.aim is None else "spot" for light in self.lights}
        return sorted(found | {"concave" if self.self_view > FACING else "convex"})

    @cached_property
    def self_view(self) -> float:
        """Part of the light that leaves the lamp's outside evenly and meets the lamp again."""
        return self_view(trimesh.util.concatenate([p.triangles for p in self.pieces]), self.radius)

    def description(self) -> dict[str, Any]:
        """JSON-ready: what tables are grouped by."""
        shining = [p for p in self.pieces if p.radiance is not None]
        return {
            "seed": self.seed,
            "index": self.index,
            "family": self.family,
            "traits": self.traits,
            "materials": sorted({kind for p in self.pieces for kind in _plugins(p.finish.bsdf)}),
            "emitters": len(shining) + len(self.lights),
            "parts": len(self.parts),
            "triangles": sum(len(p.triangles.faces) for p in self.pieces),
            "self_view": round(self.self_view, 4),
            "radius_metres": self.placement.scale * self.radius,
            "offset_radii": float(
                np.linalg.norm(self.placement.offset) / (self.placement.scale * self.radius)
            ),
        }

    def write(
        self, folder: Path, placement: Placement | None = None, *, lit: bool = True,
        name: str = "lamp",
    ) -> Path:  # fmt: skip
        """Write `<name>.xml`, its meshes and textures into the folder; returns the XML's path.

        Arguments:
            placement: instead of the lamp's own.
            lit: with its emitters, or else without.
        """
        scene = ET.Element("scene", version="3.0.0")
        scene.extend(self.elements(folder, placement, lit=lit, name=name))
        return write_xml(folder / f"{name}.xml", scene)

    def elements(
        self, folder: Path, placement: Placement | None = None, *, lit: bool = True,
        name: str = "lamp",
    ) -> list[ET.Element]:  # fmt: skip
        """Write the meshes and textures; returns the shapes and emitters that use them."""
        placement = placement or self.placement
        elements = []
        for piece in self.pieces:
            filename = f"meshes/{name}_{piece.name}.ply"
            if isinstance(piece.form, Mesh):
                _write(folder / filename, ply(piece.form, placement))
            for file, pixels in piece.finish.textures.items():
                _write(folder / "textures" / file, textures.encoded(pixels))
            elements.append(piece.element(filename, placement, lit=lit))
        return elements + [light.element(placement) for light in self.lights if lit]

    def write_description(self, folder: Path) -> None:
        """Write `lamp.json` beside the scene."""
        text = json.dumps(self.description(), indent=2) + "\n"
        _write(folder / "lamp.json", text.encode())


def family_of(seed: int, index: int) -> str:
    """The family of a lamp.

    Families take turns, in an order of each round's own, so that a zoo of any length holds them
    evenly, and lamp 7 is the same in all of them.
    """
    names = list(FAMILIES)
    round_, turn_ = divmod(index, len(names))
    return Draw(seed, 0, round_).shuffled(names)[turn_]


def make(seed: int, index: int) -> Lamp:
    """The lamp of that number in the zoo of a seed."""
    family = family_of(seed, index)
    draw = Draw(seed, 1, index)
    parts = tuple(FAMILIES[family](draw))
    unit = Lamp(seed, index, family, parts, Placement())
    return Lamp(seed, index, family, parts, _placement(draw, unit.radius))


def enlarged(lamp: Lamp, radius: float) -> Placement:
    """The lamp upright at the origin, with a sphere of that radius in metres."""
    return Placement(radius / lamp.radius, lamp.placement.rotation)


def _placement(draw: Draw, radius: float) -> Placement:
    """Millimetres to tens of metres, upright or tilted, about the origin or beside it."""
    low, high, _ = draw.pick(SIZES, [weight for *_, weight in SIZES])
    size = draw.log(low, high)
    rotation = turn("z", draw.number(0, 2 * np.pi))
    if draw.chance(0.2):
        rotation = turn("x", draw.number(-1.5, 1.5)) @ rotation
    near, far, _ = draw.pick(OFFSETS, [weight for *_, weight in OFFSETS])
    away = draw.number(near, far) * size
    polar, azimuth = np.arccos(draw.number(-1, 1)), draw.number(0, 2 * np.pi)
    offset = away * np.array(
        [np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)]
    )
    x, y, z = (float(f"{v:.6g}") for v in offset)
    return Placement(float(f"{size / radius:.9g}"), rotation[:3, :3].round(9), (x, y, z))


def _plugins(element: ET.Element) -> list[str]:
    return [e.get("type", "") for e in element.iter("bsdf")]


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    atomic.write_bytes(path, data)
