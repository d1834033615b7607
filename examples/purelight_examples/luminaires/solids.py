"""Closed bodies and open sheets that lamps of any kind are made of, besides `parts`."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

from purelight_examples.luminaires.parts import revolve, solid

Floats = NDArray[np.float64]


def joined(meshes: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    """Several meshes as one."""
    return trimesh.util.concatenate(meshes)


def inverted(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """A copy that is inside out: the wall of a hollow."""
    copy = mesh.copy()
    copy.invert()
    return copy


def lathe(loop: ArrayLike, sections: int) -> trimesh.Trimesh:
    """A closed wall turned about Z from a closed loop [K, 2] of (r, z), off the axis."""
    points = np.asarray(loop, np.float64)
    return solid(_turned(points, sections).reshape(-1, 3), _wrapped(len(points), sections))


def looped(rings: ArrayLike) -> trimesh.Trimesh:
    """A closed wall through rings [R, K, 3] of corners, the last of which leads to the first."""
    corners = np.asarray(rings, np.float64)
    return solid(corners.reshape(-1, 3), _wrapped(*corners.shape[:2]))


def band(profile: ArrayLike, thickness: float) -> Floats:
    """The loop of a wall of that thickness about an open profile [K, 2] of (r, z): [2K, 2]."""
    points = np.asarray(profile, np.float64)
    offset = 0.5 * thickness * _right(points)
    return np.concatenate((points - offset, (points + offset)[::-1]))


def dome(profile: ArrayLike, wall: float, sections: int) -> trimesh.Trimesh:
    """A solid cup turned about Z: `profile` [K, 2] goes from the axis to the rim.

    The wall lies to the right of the way along the profile: inside, if that begins on top.
    """
    points = np.asarray(profile, np.float64)
    inner = points + wall * _right(points)
    inner[0] = 0.0, points[0, 1] + wall * np.sign(inner[0, 1] - points[0, 1])
    return revolve(np.concatenate((points, inner[::-1])), sections)


def _right(points: Floats) -> Floats:
    """Unit normals to the right of a path [K, 2]."""
    tangent = np.gradient(points, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.stack((tangent[:, 1], -tangent[:, 0]), 1)


def sheet(profile: ArrayLike, sections: int, pleats: int = 0, depth: float = 0.0
          ) -> tuple[trimesh.Trimesh, Floats]:  # fmt: skip
    """An open sheet turned about Z from a profile [K, 2] of (r, z), ends off the axis.

    Arguments:
        pleats, depth: how often the radius swings around, and by what part of it.

    Returns:
        the mesh, and texture coordinates [V, 2]: around and along.
    """
    points = np.asarray(profile, np.float64)
    around, along = np.linspace(0, 1, sections + 1), np.linspace(0, 1, len(points))
    angle = 2 * np.pi * around
    radius = points[:, :1] * (1 + depth * np.cos(pleats * angle))
    vertices = np.stack(
        (radius * np.cos(angle), radius * np.sin(angle), np.repeat(points[:, 1:], len(angle), 1)),
        -1,
    )
    uv = np.stack(np.broadcast_arrays(around[None], along[:, None]), -1)
    faces = _grid(len(points), sections + 1)
    return trimesh.Trimesh(vertices.reshape(-1, 3), faces, process=False), uv.reshape(-1, 2)


def patch(grid: ArrayLike) -> tuple[trimesh.Trimesh, Floats]:
    """A surface patch [U, V, 3] as an open sheet, and its texture coordinates [U V, 2]."""
    points = np.asarray(grid, np.float64)
    rows, columns = points.shape[:2]
    uv = np.stack(
        np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij"), -1
    )
    faces = _grid(rows, columns)
    return trimesh.Trimesh(points.reshape(-1, 3), faces, process=False), uv.reshape(-1, 2)


def ring(path: ArrayLike, radius: float, sides: int) -> trimesh.Trimesh:
    """A closed round tube along a closed plane path [K, 3], its first point not repeated."""
    points = np.asarray(path, np.float64)
    tangent = np.roll(points, -1, 0) - np.roll(points, 1, 0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    centred = points - points.mean(0)
    up = np.cross(centred, tangent).sum(0)
    up /= np.linalg.norm(up)
    across = np.cross(tangent, up)
    angle = np.linspace(0, 2 * np.pi, sides, endpoint=False)[:, None]
    rings = points[:, None] + radius * (np.cos(angle) * across[:, None] + np.sin(angle) * up)
    return solid(rings.reshape(-1, 3), _wrapped(len(points), sides))


def circle(radius: float, steps: int, height: float = 0.0) -> Floats:
    """A circle about Z: [steps, 3]."""
    angle = np.linspace(0, 2 * np.pi, steps, endpoint=False)
    return np.stack((radius * np.cos(angle), radius * np.sin(angle), np.full(steps, height)), 1)


def slab(middle: ArrayLike, thickness: float) -> trimesh.Trimesh:
    """A closed body of even thickness about a surface patch [U, V, 3]."""
    grid = np.asarray(middle, np.float64)
    u, v = np.gradient(grid, axis=(0, 1))
    normal = np.cross(u, v)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return between(*(grid + 0.5 * s * thickness * normal for s in (1, -1)))


def between(upper: Floats, lower: Floats) -> trimesh.Trimesh:
    """The closed body between two surface patches [U, V, 3]."""
    rows, columns = upper.shape[:2]
    vertices = np.concatenate([side.reshape(-1, 3) for side in (upper, lower)])
    top, half = _grid(rows, columns), rows * columns
    index = np.arange(half).reshape(rows, columns)
    rim = np.concatenate((index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]))
    after = np.roll(rim, -1)
    edge = np.concatenate(
        (np.stack((rim, after, rim + half), 1), np.stack((after, after + half, rim + half), 1))
    )
    return solid(vertices, np.concatenate((top, top[:, ::-1] + half, edge[:, ::-1])))


def gem(rings: list[tuple[float, float, float]], sides: int) -> trimesh.Trimesh:
    """A cut body about Z, flat at its ends.

    Arguments:
        rings: (radius, turn in parts of a side, height) of each, from below.
    """
    points = []
    for radius, turn, height in rings:
        angle = 2 * np.pi * (np.arange(sides) + turn) / sides
        points.append(
            np.stack((radius * np.cos(angle), radius * np.sin(angle), np.full(sides, height)), 1)
        )
    ends = [[0, 0, rings[0][2]], [0, 0, rings[-1][2]]]
    i, last = np.arange(sides), sides * (len(rings) - 1)
    j = (i + 1) % sides
    faces = [np.stack((j, i, np.full(sides, last + sides)), 1)]
    for k in range(len(rings) - 1):
        low, high = sides * k, sides * (k + 1)
        # The diagonal that makes a band of triangles between rings turned against each other
        a, b = (j, i) if rings[k + 1][1] >= rings[k][1] else (i, j)
        faces += [
            np.stack((low + i, low + j, high + b), 1), np.stack((low + a, high + j, high + i), 1),
        ]  # fmt: skip
    faces.append(np.stack((last + i, last + j, np.full(sides, last + sides + 1)), 1))
    return solid(np.concatenate((*points, ends)), np.concatenate(faces))


def clear_radius(mesh: trimesh.Trimesh) -> float:
    """Radius of the largest ball about the origin inside a body that is star-shaped about it."""
    return float(np.abs((mesh.face_normals * mesh.triangles[:, 0]).sum(1)).min())


def prism(outline: ArrayLike, low: float, high: float) -> trimesh.Trimesh:
    """A solid from `low` to `high` over an outline [K, 2] that is star-shaped about its mean."""
    points = np.asarray(outline, np.float64)
    count, i = len(points), np.arange(len(points))
    j = (i + 1) % count
    vertices = [np.c_[points, np.full(count, z)] for z in (low, high)]
    ends = [[*points.mean(0), low], [*points.mean(0), high]]
    faces = [
        np.stack((i, j, i + count), 1), np.stack((j, j + count, i + count), 1),
        np.stack((j, i, np.full(count, 2 * count)), 1),
        np.stack((i + count, j + count, np.full(count, 2 * count + 1)), 1),
    ]  # fmt: skip
    return solid(np.concatenate((*vertices, ends)), np.concatenate(faces))


def tray(half: tuple[float, float, float], wall: float) -> trimesh.Trimesh:
    """A box that is open below, with walls of one thickness; `half` is half its outer size."""
    x, y, z = half
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], np.float64)
    outer, inner = corner * (x, y), corner * (x - wall, y - wall)
    loops = [(outer, z), (outer, -z), (inner, -z), (inner, z - wall)]
    vertices = np.concatenate([np.c_[xy, np.full(4, height)] for xy, height in loops])
    i = np.arange(4)
    j = (i + 1) % 4
    faces = [np.array([[0, 1, 2], [0, 2, 3], [12, 14, 13], [12, 15, 14]])]
    for k in range(3):
        low, high = 4 * k, 4 * (k + 1)
        faces.append(np.stack((low + i, high + i, low + j), 1))
        faces.append(np.stack((low + j, high + i, high + j), 1))
    return solid(vertices, np.concatenate(faces))


def _turned(points: Floats, sections: int) -> Floats:
    angle = np.linspace(0, 2 * np.pi, sections, endpoint=False)
    r, z = points[:, :1], points[:, 1:]
    return np.stack((r * np.cos(angle), r * np.sin(angle), np.repeat(z, sections, 1)), -1)


def _grid(rows: int, columns: int) -> NDArray[np.int64]:
    """Faces of a grid of vertices, row by row."""
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack((np.stack((a, b, c), -1), np.stack((a, c, d), -1)), 2).reshape(-1, 3)


def _wrapped(rows: int, columns: int) -> NDArray[np.int64]:
    """Faces of a grid whose rows and columns both close on themselves."""
    i, j = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    a, b = i * columns + j, i * columns + (j + 1) % columns
    d, c = (i + 1) % rows * columns + j, (i + 1) % rows * columns + (j + 1) % columns
    return np.stack((np.stack((a, b, c), -1), np.stack((a, c, d), -1)), 2).reshape(-1, 3)
