"""Shapes that lamps are made of, in metres: tubes, surfaces of revolution, a globe, a screw cap."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def tube(path: ArrayLike, radius: float, sides: int) -> trimesh.Trimesh:
    """A closed round tube of one radius swept along a path [K, 3].

    The cross-sections are carried along without twist (rotation-minimising frames).
    """
    points = np.asarray(path, np.float64)
    first, second = _frames(points)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    offset = np.cos(angle)[:, None] * first[:, None] + np.sin(angle)[:, None] * second[:, None]
    rings = points[:, None] + radius * offset
    vertices = np.concatenate((rings.reshape(-1, 3), points[:1], points[-1:]))
    return solid(vertices, _tube_faces(len(points), sides))


def helix(turns: int, radius: float, length: float, steps_per_turn: int) -> Floats:
    """A coil about the X axis, centred on the origin: [turns * steps_per_turn + 1, 3]."""
    along = np.linspace(-0.5, 0.5, turns * steps_per_turn + 1)
    angle = 2 * np.pi * turns * along
    return np.stack((length * along, radius * np.sin(angle), -radius * np.cos(angle)), 1)


def revolve(profile: ArrayLike, sections: int) -> trimesh.Trimesh:
    """A closed surface of revolution about Z from a profile [K, 2] of (r, z), ends on the axis."""
    inner = np.asarray(profile, np.float64)[1:-1]
    low, high = np.asarray(profile, np.float64)[[0, -1], 1]
    angle = np.linspace(0, 2 * np.pi, sections, endpoint=False)
    rings = np.stack(
        (
            inner[:, :1] * np.cos(angle),
            inner[:, :1] * np.sin(angle),
            np.repeat(inner[:, 1:], sections, 1),
        ),
        -1,
    )
    vertices = np.concatenate((rings.reshape(-1, 3), [[0, 0, low], [0, 0, high]]))
    return solid(vertices, _tube_faces(len(inner), sections))


def inset(profile: ArrayLike, wall: float) -> Floats:
    """The profile moved inwards by `wall` along its normals, still closed on the axis: [K, 2]."""
    points = np.asarray(profile, np.float64)
    tangent = np.gradient(points, axis=0)
    tangent[[0, -1], 1] = 0.0  # the ends lie flat on the axis
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    moved = points + wall * np.stack((-tangent[:, 1], tangent[:, 0]), 1)
    moved[[0, -1], 0] = 0.0
    return moved


def globe_profile(radius: float, neck_radius: float, neck_top: float, steps: int = 64) -> Floats:
    """A globe about the origin that narrows into a neck, from nadir to `neck_top`: [K, 2]."""
    leave = np.radians(145.0)  # where the sphere passes into the shoulder
    polar = np.linspace(0, leave, steps)
    sphere = radius * np.stack((np.sin(polar), -np.cos(polar)), 1)
    sphere[0, 0] = 0.0
    start, turned = sphere[-1], np.array([np.cos(leave), np.sin(leave)])
    corner = start + turned * (neck_radius - start[0]) / turned[0]
    end = np.array([neck_radius, 2 * corner[1] - start[1]])
    t = np.linspace(0, 1, steps // 4)[1:, None]
    shoulder = (1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end
    top = [[neck_radius, neck_top], [0.5 * neck_radius, neck_top], [0.0, neck_top]]
    return np.concatenate((sphere, shoulder, top))


def shell(profile: ArrayLike, wall: float, sections: int) -> trimesh.Trimesh:
    """A hollow body with a wall: one closed mesh whose normals all leave the glass."""
    hollow = revolve(inset(profile, wall), sections)
    hollow.invert()
    return trimesh.util.concatenate([revolve(profile, sections), hollow])


def screw_cap(bottom: float, radius: float, threads: int = 5) -> trimesh.Trimesh:
    """A solid screw cap about Z that rises from `bottom`, with a thread and a contact tip."""
    pitch, depth = 0.0035, 0.0007
    t = np.linspace(0, 1, 12 * threads + 1)
    top = bottom + 0.004 + threads * pitch
    thread = np.stack(
        (
            radius - depth * (1 - np.cos(2 * np.pi * threads * t)),
            bottom + 0.004 + (top - bottom - 0.004) * t,
        ),
        1,
    )
    contact = [
        [0.55 * radius, top + 0.004],
        [0.3 * radius, top + 0.0045],
        [0.25 * radius, top + 0.006],
    ]
    foot = [[0.0, bottom], [radius, bottom]]
    return revolve(np.concatenate((foot, thread, contact, [[0.0, top + 0.0065]])), 64)


def solid(vertices: ArrayLike, faces: ArrayLike) -> trimesh.Trimesh:
    """A closed mesh whose normals point outwards."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if mesh.volume < 0:
        mesh.invert()
    return mesh


def above(mesh: trimesh.Trimesh, gap: float) -> trimesh.Trimesh:
    """The faces of a shape that look along Z, lifted off it: where an LED shines, and alone."""
    upper = mesh.copy()
    upper.update_faces(upper.face_normals[:, 2] > 0.9)
    upper.remove_unreferenced_vertices()
    return upper.apply_translation([0.0, 0.0, gap])


def _frames(points: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors across the path at each point, without twist: [K, 3] each."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.cross(tangent[0], np.eye(3)[np.argmin(np.abs(tangent[0]))])
    first = np.empty_like(points)
    for i, along in enumerate(tangent):
        across = across - along * np.dot(across, along)
        across /= np.linalg.norm(across)
        first[i] = across
    return first, np.cross(tangent, first)


def _tube_faces(rings: int, sides: int) -> NDArray[np.int64]:
    """Faces of stacked rings closed by a fan at each end; the fan centres are the last vertices."""
    i = np.arange(sides)
    j = (i + 1) % sides
    start = sides * np.arange(rings - 1)[:, None]
    lower = np.stack((start + i, start + j, start + sides + j), -1).reshape(-1, 3)
    upper = np.stack((start + i, start + sides + j, start + sides + i), -1).reshape(-1, 3)
    last, centre = sides * (rings - 1), np.full(sides, sides * rings)
    fans = np.concatenate(
        (np.stack((j, i, centre), 1), np.stack((last + i, last + j, centre + 1), 1))
    )
    return np.concatenate((lower, upper, fans))
