"""Participating media: Beer's law, conserved power, and Mitsuba's own volumetric path tracer."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from tests.support.irradiance import assert_same_irradiance

EXTINCTION = np.array([0.5, 2.0, 20.0])
RADIUS, BULB = 0.5, 0.1


def rgb(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def medium(albedo: Any, extinction: Any = None, scale: float = 20.0, g: float = 0.0) -> Any:
    if extinction is None:
        extinction = rgb(*(EXTINCTION / 20))
    return {
        "type": "homogeneous",
        "albedo": albedo,
        "sigma_t": extinction,
        "scale": scale,
        "phase": {"type": "hg", "g": g},
    }


def cloud(mi: Any, albedo: Any) -> dict[str, Any]:
    """A medium whose density varies over a grid around the ball of `ball`."""
    grid = np.random.default_rng(0).uniform(0, 1, (4, 4, 4, 1)).astype(np.float32)
    box = mi.ScalarTransform4f().translate([-RADIUS] * 3).scale(2 * RADIUS)
    return {
        "type": "heterogeneous",
        "albedo": albedo,
        "sigma_t": {"type": "gridvolume", "grid": mi.VolumeGrid(grid), "to_world": box},
        "scale": 8.0,
    }


def ball(interior: Any, bsdf: Any = None) -> dict[str, Any]:
    """A glowing black ball in the middle of a ball of a medium."""
    black = {"type": "diffuse", "reflectance": 0.0}
    return {
        "filled": {
            "type": "sphere", "radius": RADIUS, "bsdf": bsdf or {"type": "null"},
            "interior": {**interior, "id": "inside"},
        },
        "bulb": {
            "type": "sphere", "radius": BULB, "bsdf": black,
            "emitter": {"type": "area", "radiance": rgb(3, 2, 1)},
            "exterior": {"type": "ref", "id": "inside"},
        },
    }  # fmt: skip


def emitted() -> np.ndarray:
    return 4 * math.pi**2 * BULB**2 * np.array([3.0, 2.0, 1.0])


@pytest.mark.parametrize("stated", [True, False])
def test_absorption_follows_beers_law(stated: bool, mitsuba: Any) -> None:
    """Exact where nothing is scattered: one weight a path, no path lost.

    A bulb that is cast in stands in what is around it, whether the scene says so or not.
    """
    from purelight_train.light.light_tracing import trace_records

    parts = ball(medium(0.0))
    if not stated:
        del parts["bulb"]["exterior"]
        parts["cap"] = {"type": "disk", "to_world": mitsuba.ScalarTransform4f().scale(0.01 * BULB)}
    scene = mitsuba.load_dict({"type": "scene", **parts})
    records = trace_records(scene, 1, 0)
    sine2 = (np.arange(4000) + 0.5) / 4000  # uniform in sin², as Lambert's cosine is
    length = np.sqrt(RADIUS**2 - BULB**2 * sine2) - BULB * np.sqrt(1 - sine2)
    expected = emitted() * np.exp(-length[:, None] * EXTINCTION).mean(0)
    assert (np.abs(records.flux - expected) < 4 * records.flux_error).all()
    assert (records.flux_error < 2e-3 * expected).all()
    assert len(records) == records.paths
    assert not records.bare.any()
    np.testing.assert_allclose(np.linalg.norm(records.position, axis=1), RADIUS, rtol=1e-5)


@pytest.mark.parametrize("kind", ["homogeneous", "heterogeneous"])
def test_white_medium_loses_nothing(mitsuba: Any, kind: str) -> None:
    """A white bulb in a white medium: all power comes out, however often it is scattered."""
    from purelight_train.light.light_tracing import trace_records

    inside = cloud(mitsuba, 1.0) if kind == "heterogeneous" else medium(1.0, g=0.6)
    parts = ball(inside)
    parts["bulb"]["bsdf"] = {"type": "diffuse", "reflectance": 1.0}
    records = trace_records(mitsuba.load_dict({"type": "scene", **parts}), 1, 0)
    assert (np.abs(records.flux - emitted()) < 4 * records.flux_error + 1e-4 * emitted()).all()
    assert records.cut == records.dropped == 0
    # The sum over the channels never grows, so no weight can explode
    assert records.weight.sum(1).max() < 1.001 * emitted().sum()


@pytest.mark.parametrize(
    "kind",
    ["homogeneous", "heterogeneous", pytest.param("glass", marks=pytest.mark.slow)],
)
def test_path_tracing_agrees(mitsuba: Any, kind: str) -> None:
    albedo = rgb(0.9, 0.6, 0.3)
    extinction = rgb(0.3, 0.2, 0.1)
    parts = {
        "homogeneous": lambda: ball(medium(albedo, extinction, g=0.5)),
        "heterogeneous": lambda: ball(cloud(mitsuba, albedo)),
        "glass": lambda: ball(
            medium(albedo, extinction), {"type": "roughdielectric", "alpha": 0.2, "int_ior": 1.3}
        ),
    }[kind]()
    assert_same_irradiance(mitsuba, parts, precision=0.03)


def test_straight_lines_are_attenuated(mitsuba: Any) -> None:
    """Through a null ball, coloured glass and a cloud: exp of minus the depth along the line."""
    from purelight_train.light.transmittance import transmittance_samples

    count = 1 << 16
    height = np.linspace(-0.9, 0.9, count, dtype=np.float32) * RADIUS
    origin = np.stack((height, np.zeros_like(height), np.full_like(height, -2)), 1)
    upward = np.tile(np.array([0, 0, 1], np.float32), (count, 1))

    def through(interior: Any, bsdf: Any) -> np.ndarray:
        shape = {"type": "sphere", "radius": RADIUS, "bsdf": bsdf, "interior": interior}
        scene = mitsuba.load_dict({"type": "scene", "ball": shape})
        return transmittance_samples(scene, origin, upward, 0)

    depth = 2 * np.sqrt(RADIUS**2 - height.astype(np.float64) ** 2)[:, None]
    exact = np.exp(-depth * EXTINCTION)
    null = {"type": "null"}
    np.testing.assert_allclose(through(medium(0.0), null), exact, rtol=5e-3)
    # An index of one reflects nothing, a tint is taken at both faces
    tinted = {"type": "dielectric", "int_ior": 1.0001, "ext_ior": 1.0,
              "specular_transmittance": rgb(0.5, 0.6, 0.7)}  # fmt: skip
    mean = through(medium(0.0), tinted).mean(0)
    expected = exact.mean(0) * np.array([0.5, 0.6, 0.7]) ** 2
    np.testing.assert_allclose(mean, expected, rtol=0.01)
    uneven = through(cloud(mitsuba, 0.0), null)
    grid = np.random.default_rng(0).uniform(0, 1, (4, 4, 4, 1)).astype(np.float32)
    optical = 8.0 * _depth_along(grid[..., 0], height)
    error = uneven.std(0) / math.sqrt(count)
    assert (np.abs(uneven.mean(0) - np.exp(-optical).mean()) < 4 * error + 1e-4).all()


def _depth_along(grid: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Integral of a trilinear grid [z, y, x] over the ball along z, at y = 0, by midpoints."""
    from scipy.ndimage import map_coordinates

    part = slice(None, None, 64)
    half = np.sqrt(RADIUS**2 - height[part].astype(np.float64) ** 2)
    z = half[:, None] * (2 * (np.arange(200) + 0.5) / 200 - 1)
    x = np.broadcast_to(height[part, None], z.shape)
    at = np.stack((z, np.zeros_like(z), x)) / (2 * RADIUS) + 0.5
    value = map_coordinates(grid, at.reshape(3, -1) * 4 - 0.5, order=1, mode="nearest")
    return value.reshape(z.shape).mean(1) * 2 * half
