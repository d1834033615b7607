"""Shapes of lamps: closed, outward, and as large as their formulas say."""

from __future__ import annotations

import numpy as np
import pytest

from purelight_examples.luminaires.parts import (
    globe_profile,
    helix,
    inset,
    revolve,
    screw_cap,
    shell,
    tube,
)


def sphere_profile(radius: float) -> np.ndarray:
    polar = np.linspace(0, np.pi, 129)
    profile = radius * np.stack((np.sin(polar), -np.cos(polar)), 1)
    profile[[0, -1], 0] = 0.0
    return profile


def test_tube_is_closed_and_has_the_area_of_a_cylinder() -> None:
    mesh = tube([[0, 0, 0], [0, 0, 0.5], [0, 0, 1]], 0.1, sides=64)
    assert mesh.is_watertight
    assert mesh.area == pytest.approx(2 * np.pi * 0.1 * (1 + 0.1), rel=2e-3)
    assert mesh.volume == pytest.approx(np.pi * 0.01, rel=2e-3)


def test_coil_keeps_its_wire_radius() -> None:
    path = helix(5, 0.004, 0.03, 40)
    mesh = tube(path, 0.0007, sides=12)
    rings = mesh.vertices[:-2].reshape(len(path), 12, 3)
    distance = np.linalg.norm(rings - path[:, None], axis=-1)
    np.testing.assert_allclose(distance, 0.0007, rtol=1e-9)
    assert mesh.is_watertight
    assert mesh.volume > 0


def test_revolved_half_circle_is_a_sphere() -> None:
    mesh = revolve(sphere_profile(0.05), 128)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * 0.05**3, rel=2e-3)


def test_shell_holds_the_volume_between_two_spheres() -> None:
    mesh = shell(sphere_profile(0.05), 0.002, 128)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi * (0.05**3 - 0.048**3), rel=5e-3)


def test_inset_moves_every_point_by_the_wall() -> None:
    outline = sphere_profile(0.05)
    np.testing.assert_allclose(np.linalg.norm(inset(outline, 0.002), axis=1), 0.048, rtol=1e-4)


def test_globe_runs_from_nadir_to_the_neck() -> None:
    outline = globe_profile(0.05, 0.0125, 0.068)
    np.testing.assert_allclose(outline[[0, -1]], [[0, -0.05], [0, 0.068]])
    assert outline[:, 0].max() == pytest.approx(0.05, rel=1e-3)
    assert (outline[:, 0] >= 0).all()


def test_cap_is_a_solid_above_its_bottom() -> None:
    mesh = screw_cap(0.064, 0.014)
    assert mesh.is_watertight
    assert mesh.volume > 0
    assert mesh.bounds[0, 2] == pytest.approx(0.064)
