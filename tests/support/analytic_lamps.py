"""Lamps whose networks are short formulas, and rooms in which Mitsuba has the same lamp."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import trimesh

from purelight_export.graph import Graph, Value
from purelight_export.photometry import Intensity, ies_file
from purelight_format import bundle
from purelight_format.measures import BoundingSphere, Cap, cap, cap_to_direction, direction_to_cap
from purelight_format.members.finishes import Finish
from purelight_format.members.surface import Surface
from purelight_format.networks.vectors import Vectors
from purelight_format.photometry.table import node_solid_angle
from tests.support import bundles

CENTRE = (0.3, -0.2, 0.1)
RADIUS = 0.25
COLOUR = np.array([3.0, 2.0, 1.0])
SPHERE = BoundingSphere(CENTRE, RADIUS)


@dataclass(frozen=True)
class Lamp:
    """An exit surface, its networks as ONNX, what it is made of, and its stated fidelity."""

    surface: Surface
    networks: dict[str, bytes]
    flux: np.ndarray
    finishes: tuple[Finish, ...] = ()
    fidelity: dict[str, Any] = field(default_factory=dict)

    def write(self, path: Path, more: dict[str, bytes] | None = None) -> Path:
        """Writes the lamp as a valid bundle, with more members if wanted."""
        manifest, members = bundles.parts(
            self.surface,
            {name: (model, _golden(name, model)) for name, model in self.networks.items()},
            name=path.stem,
            bounding_sphere=SPHERE,
            flux=tuple(map(float, self.flux)),
            radiance_scale=1.0,
            r_max=15.0,
            channels=tuple(self.flux > 0),
            finishes=self.finishes,
            fidelity=self.fidelity,
        )
        bundle.write(path, manifest, members | (more or {}))
        return path


def _golden(name: str, model: bytes) -> Vectors:
    rng = np.random.default_rng(0)
    away = rng.normal(size=(64, 3))
    away[:, 2] = -np.abs(away[:, 2])  # Where even the spoilt lamp answers.
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    point = np.array(CENTRE) + away * RADIUS * 4
    inputs: dict[str, Any]
    if name in ("appearance", "transparency"):
        inputs = {"position": point, "normal": away, "outgoing": away}
    else:
        inputs = {"point": point, "u": rng.uniform(0.2, 0.8, (64, 2)), "toward": -away}
        wanted = {"sampler": ("point", "u"), "sampler_pdf": ("point", "toward")}
        inputs = {key: inputs[key] for key in wanted.get(name, ("point",))}
    inputs = {key: value.astype(np.float32) for key, value in inputs.items()}
    return bundles.vectors(name, model, inputs, lambda y: 1e-3 * (np.abs(y) + 1e-3))


# Networks


def appearance(tilt: float = 0.0, spoilt: bool = False) -> bytes:
    """radiance = COLOUR (1 + tilt sign(normal_x)), or NaN on the upper half."""
    graph = Graph("appearance")
    position, normal, _ = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    factor = graph.sign(graph.slice(normal, 0, 1)) * tilt + 1.0
    if spoilt:
        height = graph.slice(position, 2, 3) - CENTRE[2]
        factor = factor * graph.sqrt(graph.sign(height) * -1.0)
    graph.output("radiance", factor * COLOUR)
    return graph.to_bytes()


def transparency(through: Sequence[float]) -> bytes:
    """A constant transmittance."""
    graph = Graph("transparency")
    position, *_ = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    graph.output("transmittance", position * 0.0 + np.asarray(through))
    return graph.to_bytes()


def _pdf(graph: Graph, view: Cap[Value]) -> Value:
    return graph.where(view.outside, 1.0 / view.solid_angle, 0.0)


def sampler() -> bytes:
    """Uniform directions in the cap."""
    graph = Graph("sampler")
    point, u = graph.input("point", 3), graph.input("u", 2)
    view = cap(point, SPHERE)
    toward = cap_to_direction(u, view)
    graph.output("toward", graph.where(view.outside, toward, view.axis))
    graph.output("pdf_solid_angle", graph.flatten(_pdf(graph, view)))
    return graph.to_bytes()


def sampler_pdf() -> bytes:
    """The density of `sampler`."""
    graph = Graph("sampler_pdf")
    point, toward = graph.input("point", 3), graph.input("toward", 3)
    view = cap(point, SPHERE)
    _, inside = direction_to_cap(toward, view)
    pdf = graph.where(view.outside & inside, _pdf(graph, view), 0.0)
    graph.output("pdf_solid_angle", graph.flatten(pdf))
    return graph.to_bytes()


def fast_map(colour: Sequence[float] = COLOUR) -> bytes:
    """A ball of constant radiance fills its cap."""
    graph = Graph("fast_map")
    point = graph.input("point", 3)
    zero = graph.slice(point, 0, 1) * 0.0
    cells = zero + np.tile(colour, 256)
    graph.output("radiance_map", graph.reshape(cells, 16, 16, 3))
    return graph.to_bytes()


def shining_map() -> bytes:
    """A map like a trained one: a few layers and an exponential, half of its cells dark."""
    graph, rng = Graph("fast_map"), np.random.default_rng(7)
    x = (graph.input("point", 3) - np.array(CENTRE)) * (1 / RADIUS)
    for width in (24, 24):
        weight = rng.normal(size=(width, x.shape[0])) / math.sqrt(x.shape[0])
        x = graph.relu(graph.linear(x, weight.astype(np.float32), np.ones(width, np.float32)))
    weight, bias = rng.normal(size=(768, 24)) / 3, rng.normal(size=768)
    raw = graph.linear(x, weight.astype(np.float32), bias.astype(np.float32))
    radiance = graph.exp(graph.clip(raw, 0.0, 4.0)) - 1.0
    graph.output("radiance_map", graph.channels_last(graph.reshape(radiance, 3, 16, 16)))
    return graph.to_bytes()


# Lamps


def ball(tilt: float = 0.0, *, learned: bool = True, spoilt: bool = False) -> Lamp:
    """An opaque ball that fills the bounding sphere."""
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    networks = {"appearance": appearance(tilt, spoilt), "fast_map": fast_map()}
    if learned:
        networks |= {"sampler": sampler(), "sampler_pdf": sampler_pdf()}
    return Lamp(_surface(mesh), networks, math.pi * mesh.area * COLOUR)


def glass_sheet(through: Sequence[float]) -> Lamp:
    """A dark square sheet across the sphere that lets a part of the light pass."""
    corner = RADIUS / math.sqrt(2)
    vertices = np.array([[x, y, 0] for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]) * corner
    mesh = trimesh.Trimesh(vertices, [[0, 1, 2], [0, 2, 3]], process=False)
    networks = {"appearance": black(), "transparency": transparency(through)}
    return Lamp(_surface(mesh, 0.0), networks, np.zeros(3))


def two_panes(through: float, offset: float = 0.1) -> Lamp:
    """Dark square panes across the x axis; a line that has both ahead is let through twice."""
    graph = Graph("transparency")
    position, _, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    side = graph.sign(graph.slice(position, 0, 1) - CENTRE[0])
    both = side * graph.sign(graph.slice(outgoing, 0, 1))
    one, two = through, through**2
    level = both * (0.5 * (two - one)) + 0.5 * (two + one)
    graph.output("transmittance", position * 0.0 + level)
    networks = {"appearance": black(), "transparency": graph.to_bytes()}
    corners = [(y, z) for y, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    half = 0.6 * RADIUS
    vertices = [(x, y * half, z * half) for x in (offset, -offset) for y, z in corners]
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    mesh = trimesh.Trimesh(np.array(vertices), faces, process=False)
    return Lamp(_surface(mesh, 0.0), networks, np.zeros(3))


def black() -> bytes:
    graph = Graph("appearance")
    position, *_ = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    graph.output("radiance", position * 0.0)
    return graph.to_bytes()


def _surface(mesh: trimesh.Trimesh, level: float = 1.0) -> Surface:
    positions = np.asarray(mesh.vertices + np.array(CENTRE), np.float32)
    flux = (mesh.area_faces[:, None] * math.pi * COLOUR * level).astype(np.float32)
    return Surface(positions, np.asarray(mesh.faces, np.uint32), flux)


def photometry(lamp: Lamp, exponent: float) -> bytes:
    """Intensity by a power of the cosine to -Z."""
    vertical, horizontal = np.linspace(0, 180, 37), np.linspace(0, 360, 25)
    cosine = np.maximum(np.cos(np.radians(vertical)), 0)
    falling = cosine**exponent if exponent else np.ones_like(vertical)
    total = falling @ node_solid_angle(vertical)
    values = np.broadcast_to(falling[:, None] * lamp.flux / total, (25, 37, 3))
    return ies_file(
        Intensity(vertical, horizontal, values), name="x", issued="2026-01-01", radius=1
    )


# Scenes


def mitsuba_lamps(
    lamp: Lamp, folder: Path, placement: Any, *, tilt: float = 0.0, dimmer: float = 1.0,
    bsdf: dict[str, Any] | None = None,
) -> dict[str, Any]:  # fmt: skip
    """The same lamp as two meshes of Mitsuba's, one per half, with area emitters."""
    surface = lamp.surface
    matrix = np.array(placement.matrix).reshape(4, 4)
    positions = surface.positions @ matrix[:3, :3].T + matrix[:3, 3]
    corners = surface.positions.astype(np.float64)[surface.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    shapes = {}
    for name, half, sign in (("a", normal[:, 0] > 0, 1), ("b", normal[:, 0] <= 0, -1)):
        path = folder / f"{name}{len(list(folder.iterdir()))}.ply"
        trimesh.Trimesh(positions, surface.triangles[half], process=False).export(path)
        radiance = {"type": "rgb", "value": list(dimmer * COLOUR * (1 + sign * tilt))}
        shapes[path.stem] = {
            "type": "ply",
            "filename": str(path),
            "face_normals": True,
            "bsdf": bsdf or {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.0}},
            "emitter": {"type": "area", "radiance": radiance},
        }
    return shapes


def look_at(origin: Sequence[float], target: Sequence[float]) -> Any:
    return mi.ScalarTransform4f().look_at(list(origin), list(target), [0, 0, 1])


def room(*, size: int = 32, floor: Any = None, wall: Any = None) -> dict[str, Any]:
    """A floor and a wall, seen from one side."""
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.6, 0.5, 0.4]}}
    transform = mi.ScalarTransform4f
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 55, "film": film}
    sensor["to_world"] = look_at((2.2, 1.2, 1.4), (0, 0, 0.3))
    return {
        "type": "scene",
        "sensor": sensor,
        "floor": {
            "type": "rectangle",
            "to_world": transform().translate([0, 0, -0.6]).scale(1.5),
            "bsdf": floor or grey,
        },
        "wall": {
            "type": "rectangle",
            "to_world": transform().translate([-1, 0, 0.4]).rotate([0, 1, 0], 90).scale(1.5),
            "bsdf": wall or grey,
        },
    }
