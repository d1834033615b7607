"""Lamps for Blender, whose light depends on where and whither: two balls, and one ball."""

from __future__ import annotations

import math

import numpy as np
import trimesh

from purelight_export.graph import Graph
from purelight_format.measures import Placement
from purelight_format.members.surface import Surface
from purelight_onnx.luminaire import Luminaire
from tests.support.analytic_lamps import CENTRE, COLOUR, RADIUS, Lamp, transparency

THROUGH = (0.5, 0.6, 0.7)


def appearance(spread: float = 1.0) -> bytes:
    """Radiance that varies with the place, the normal and the direction."""
    graph = Graph("appearance")
    position, normal, outgoing = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    x, y, _ = graph.columns((position - np.array(CENTRE)) * (1 / RADIUS))
    facing = graph.sum(normal * outgoing)
    level = 1.2 + spread * (x * 0.5 + y * graph.slice(outgoing, 0, 1) * 0.5)
    level = graph.clip(level, 0.0, 10.0)  # Golden rays begin beyond the ball.
    graph.output("radiance", (level * (facing * 0.5 + 0.5)) * COLOUR)
    return graph.to_bytes()


def two_balls(*, opaque: bool = False) -> Lamp:
    """Two glass balls side by side along x: a ray may cross both."""
    one = trimesh.creation.icosphere(subdivisions=3, radius=0.45 * RADIUS)
    other = one.copy()
    one.apply_translation([-0.5 * RADIUS, 0, 0])
    other.apply_translation([0.5 * RADIUS, 0, 0])
    return _lamp(one + other, opaque)


def glass_ball(*, opaque: bool = False) -> Lamp:
    """One, closed and convex."""
    return _lamp(trimesh.creation.icosphere(subdivisions=3, radius=RADIUS), opaque)


def gridded() -> Lamp:
    """A ball whose light is read from a table of 80,000 numbers, which OSL has in a texture."""
    graph = Graph("appearance")
    position, *_ = (graph.input(n, 3) for n in ("position", "normal", "outgoing"))
    turns = np.linspace(0, 6 * np.pi, 20_000)[:, None]
    table = graph.constant((1 + 0.5 * np.sin(turns + np.arange(4))).astype(np.float32))
    x = (graph.slice(position, 0, 1) - CENTRE[0]) * (1 / RADIUS)
    row = graph.cast(graph.clip((x * 0.5 + 0.5) * 19_999.0, 0.0, 19_999.0), np.int64)
    found = graph.reshape(graph.gather(table, row), 4)
    graph.output("radiance", graph.slice(found, 0, 3) * COLOUR)
    ball = glass_ball(opaque=True)
    return Lamp(ball.surface, {"appearance": graph.to_bytes()}, ball.flux)


def _lamp(mesh: trimesh.Trimesh, opaque: bool) -> Lamp:
    """With a stated flux that closes: that of evenly shining triangles."""
    networks = {"appearance": appearance()}
    if not opaque:
        networks["transparency"] = transparency(THROUGH)
    flux = (mesh.area_faces[:, None] * math.pi * COLOUR).astype(np.float32)
    positions = np.asarray(mesh.vertices + np.array(CENTRE), np.float32)
    surface = Surface(positions, np.asarray(mesh.faces, np.uint32), flux)
    return Lamp(surface, networks, flux.astype(np.float64).sum(0))


def view(
    lamp: Luminaire, to_world: np.ndarray, camera: np.ndarray, size: float, pixels: int,
    background: float = 0.0, dimmer: float = 1.0,
) -> np.ndarray:  # fmt: skip
    """What an orthographic camera sees: [pixels, pixels, 3], NaN where a rim is near."""
    place = Placement.of(to_world, "the lamp")
    along = ((np.arange(pixels) + 0.5) / pixels - 0.5) * size
    found = [_seen(lamp, place, camera, along, shift, background, dimmer)
             for shift in (0.0, 1e-3 * size, -1e-3 * size)]  # fmt: skip
    same = np.isclose(found[0], found[1], rtol=0.2) & np.isclose(found[0], found[2], rtol=0.2)
    return np.where(same.all(-1, keepdims=True), found[0], np.nan)


def _seen(
    lamp: Luminaire, place: Placement, camera: np.ndarray, along: np.ndarray, shift: float,
    background: float, dimmer: float,
) -> np.ndarray:  # fmt: skip
    x, y = np.meshgrid(along + shift, -along + shift)
    local = np.stack((x, y, np.zeros_like(x), np.ones_like(x)), -1).reshape(-1, 4)
    start = (local @ camera.T)[:, :3]
    toward = np.tile(-camera[:3, 2], (len(start), 1))
    origin, direction = place.point_to_local(start), place.direction_to_local(toward)
    hits = lamp.exit_surface.intersect(origin, direction)
    seen = np.full((len(start), 3), background)
    asked = hits.position, hits.normal, -direction[hits.ray]
    passed = lamp.transmittance(*asked) if lamp.has("transparency") else 0.0
    seen[hits.ray] = dimmer * lamp.radiance(*asked) + passed * background
    return seen.reshape(len(along), len(along), 3)
