"""Rays of an exit surface as points of a cube, there and back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

pytest.importorskip("mitsuba")


@pytest.fixture(params=["ball", "sheet", "box"])
def surface(request: Any, mitsuba: Any) -> Any:
    from purelight_train.light.exit_surface import ExitSurface

    mesh = {
        "ball": trimesh.creation.icosphere(subdivisions=4),
        "sheet": trimesh.creation.annulus(0.2, 1.0, 1e-6, sections=16),
        "box": trimesh.creation.box((1, 2, 0.1)),
    }[request.param]
    if request.param == "sheet":  # One face of a thin disk.
        mesh.update_faces(mesh.face_normals[:, 2] > 0.5)
    two_sided = np.full(len(mesh.faces), request.param == "sheet")
    return ExitSurface(mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32), two_sided)


def test_places_of_rays_are_where_they_came_from(surface: Any) -> None:
    from purelight_train.light.ray_chart import RayChart

    chart = RayChart(surface)
    place = np.random.default_rng(0).random((1 << 12, 4))
    position, normal, outgoing = chart.rays(place)
    hits = surface.intersect(position + 0.01 * outgoing, -outgoing)
    own = np.linalg.norm(hits.position - position[hits.index], axis=1) < 1e-4
    index = hits.index[own]
    assert len(index) > 0.9 * len(place)
    again = chart.place(position[index], normal[index], outgoing[index], hits.triangle[own])
    same = np.abs(again - place[index]).max(1) < 1e-2
    assert same.mean() > 0.99  # Both sides of a sheet, and edges, may be told apart otherwise.


def test_neighbours_stay_near(surface: Any) -> None:
    """A small step of the first coordinate is mostly a small one on the surface."""
    from purelight_train.light.ray_chart import RayChart

    chart, rng = RayChart(surface), np.random.default_rng(1)
    place = rng.random((1 << 10, 4))
    place[:, 0] *= 0.99
    step = place + np.array([0.001, 0, 0, 0])
    distance = np.linalg.norm(chart.rays(step)[0] - chart.rays(place)[0], axis=1)
    assert np.median(distance) < 0.25 * surface.sphere.radius
