"""Mitsuba's shapes by formula, as meshes in their own frame."""

from __future__ import annotations

import numpy as np
import trimesh

from purelight_import.model.mesh import Mesh

SECTIONS = 128


def sphere() -> Mesh:
    """Of radius one."""
    made = trimesh.creation.icosphere(subdivisions=5)
    vertices = np.array(made.vertices)
    return Mesh(vertices, np.array(made.faces, np.uint32), vertices.copy())


def disk() -> Mesh:
    """Of radius one, facing +Z."""
    i = np.arange(SECTIONS)
    faces = np.stack((np.zeros_like(i), i + 1, (i + 1) % SECTIONS + 1), 1)
    return Mesh(np.concatenate(([[0.0, 0, 0]], _ring())), faces.astype(np.uint32))


def rectangle() -> Mesh:
    """From -1 to 1, facing +Z."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    uv = 0.5 * corners[:, :2] + 0.5
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), None, uv)


def cylinder() -> Mesh:
    """Of radius one around Z from 0 to 1, without ends."""
    low = _ring()
    i, j = np.arange(SECTIONS), (np.arange(SECTIONS) + 1) % SECTIONS
    faces = np.concatenate(
        (np.stack((i, j, i + SECTIONS), 1), np.stack((j, j + SECTIONS, i + SECTIONS), 1))
    )
    vertices = np.concatenate((low, low + np.array([0, 0, 1])))
    return Mesh(vertices, faces.astype(np.uint32), np.concatenate((low, low)))


def _ring() -> np.ndarray:
    angle = np.linspace(0, 2 * np.pi, SECTIONS, endpoint=False)
    return np.stack((np.cos(angle), np.sin(angle), np.zeros(SECTIONS)), 1)


SOLIDS = {"sphere": sphere, "disk": disk, "rectangle": rectangle, "cylinder": cylinder}
