"""Mitsuba's shapes by formula, as meshes in their own frame, with Mitsuba's texture coordinates."""

from __future__ import annotations

import numpy as np

from purelight_import.model.mesh import Floats, Mesh

SECTIONS, ROWS = 144, 72  # around Z, and of a sphere from pole to pole


def sphere() -> Mesh:
    """Of radius one; u runs around Z, v from +Z to -Z."""
    polar = np.linspace(0, np.pi, ROWS + 1)
    radius = np.sin(polar)
    radius[[0, -1]] = 0
    mesh = _turned_around(radius, np.cos(polar), polar / np.pi)
    return Mesh(mesh.positions, mesh.triangles, mesh.positions.copy(), mesh.uv)


def disk() -> Mesh:
    """Of radius one, facing +Z; u runs from the middle to the edge, v around Z."""
    radius = np.array([0.0, 1])
    mesh = _turned_around(radius, np.zeros(2), radius)
    assert mesh.uv is not None
    return Mesh(mesh.positions, mesh.triangles, None, mesh.uv[:, ::-1].copy())


def rectangle() -> Mesh:
    """From -1 to 1, facing +Z."""
    corners = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    uv = 0.5 * corners[:, :2] + 0.5
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]], np.uint32), None, uv)


def cylinder() -> Mesh:
    """Of radius one around Z from 0 to 1, without ends; u runs around Z, v along it."""
    height = np.array([1.0, 0])
    mesh = _turned_around(np.ones(2), height, height)
    return Mesh(mesh.positions, mesh.triangles, mesh.positions * [1, 1, 0], mesh.uv)


def _turned_around(radius: Floats, height: Floats, along: Floats) -> Mesh:
    """A profile turned around Z from +X on, whose front is on the left of one who goes along it.

    The last column stands where the first does, so that no triangle wraps around the picture, and
    at a pole each triangle has a corner of its own, amid its column.

    Arguments:
        radius, height: of the profile's points, [R]; poles are its ends.
        along: their second coordinate; the first one is the share of a turn.
    """
    column, row = np.meshgrid(np.arange(SECTIONS + 1), np.arange(len(radius)))
    angle = 2 * np.pi / SECTIONS * (column % SECTIONS)
    pole = radius[row] == 0
    around = (column + np.where(pole, np.where(row == 0, 0.5, -0.5), 0)) / SECTIONS
    place = (radius[row] * np.cos(angle), radius[row] * np.sin(angle), height[row])
    number = row * (SECTIONS + 1) + column
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    lower, upper = np.stack((a, b, c), -1)[~pole[1:, 1:]], np.stack((a, c, d), -1)[~pole[:-1, 1:]]
    triangles = np.concatenate((lower, upper)).astype(np.uint32)
    uv = np.stack((around, along[row]), -1)
    return Mesh(np.stack(place, -1).reshape(-1, 3), triangles, None, uv.reshape(-1, 2))


SOLIDS = {"sphere": sphere, "disk": disk, "rectangle": rectangle, "cylinder": cylinder}
