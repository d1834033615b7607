"""Furniture and walls of a room as meshes: boxes, turned shapes, and a room seen from inside."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import trimesh

from purelight_examples.luminaires.parts import revolve

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def boxes(items: Iterable[Box]) -> trimesh.Trimesh:
    """Boxes given by their centre and size in metres, as one mesh."""
    meshes = []
    for centre, size in items:
        box = trimesh.creation.box(extents=size)
        meshes.append(box.apply_translation(centre))
    return trimesh.util.concatenate(meshes)


def turned(profile: list[tuple[float, float]], at: tuple[float, float, float]) -> trimesh.Trimesh:
    """A shape turned about Z from a profile of (r, z), moved to `at`."""
    return revolve(smooth(profile), 96).apply_translation(at)


def smooth(profile: list[tuple[float, float]], times: int = 3) -> np.ndarray:
    """The profile with its corners cut (Chaikin 1974), its ends kept."""
    points = np.asarray(profile, np.float64)
    for _ in range(times):
        a, b = points[:-1], points[1:]
        cut = np.stack((0.75 * a + 0.25 * b, 0.25 * a + 0.75 * b), 1).reshape(-1, 2)
        points = np.concatenate((points[:1], cut[1:-1], points[-1:]))
    return points


def wall(
    centre: tuple[float, float, float], inward: int, half: tuple[float, float]
) -> trimesh.Trimesh:
    """A rectangle across one axis whose normal points into the room.

    Arguments:
        inward: 1, 2 or 3 for a normal along +X, +Y or +Z, negative for the opposite.
        half: half its size along the next two axes in cyclic order.
    """
    axis = abs(inward) - 1
    u, v = np.eye(3)[(axis + 1) % 3] * half[0], np.eye(3)[(axis + 2) % 3] * half[1]
    corners = np.asarray(centre) + np.array([-u - v, u - v, u + v, v - u])
    order = [[0, 1, 2], [0, 2, 3]] if inward > 0 else [[0, 2, 1], [0, 3, 2]]
    return trimesh.Trimesh(corners, order, process=False)
