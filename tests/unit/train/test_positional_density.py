"""Photon map: a uniform lamp has uniform exitance, edges included."""

from __future__ import annotations

import math
from typing import Any

import numpy as np


def test_uniform_sphere_and_its_flux(mitsuba: Any) -> None:
    from purelight_train.light.exit_records import settle
    from purelight_train.light.light_tracing import trace_records
    from purelight_train.light.luminaire import scene_triangles
    from purelight_train.light.positional_density import PositionalDensity
    from purelight_train.light.visible_part import visible_part

    cube = {
        "type": "cube",
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [2.0, 1.0, 0.0]}},
    }
    scene = mitsuba.load_dict({"type": "scene", "cube": cube})
    rng = np.random.default_rng(0)
    surface = visible_part(*scene_triangles(scene), 1 << 16, rng)
    assert surface.area == 24.0
    records, triangle = settle(trace_records(scene, 1 << 20, 0), surface)
    assert (triangle >= 0).all()
    assert records.channels == (True, True, False)
    density = PositionalDensity.build(records, surface, 1000, rng)
    position, normal = surface.sample(4000, rng)
    exitance = density.exitance(position, normal)
    expected = math.pi * np.array([2.0, 1.0, 0.0])
    np.testing.assert_allclose(exitance.mean(0), expected, rtol=5e-3)
    # Edges of the cube would lose up to half without the estimate of the area
    relative = exitance[:, 0] / expected[0]
    assert np.percentile(np.abs(relative - 1), 99) < 0.2


def test_neighbour_sum_counts_by_distance_and_normal(mitsuba: Any) -> None:
    from purelight_train.light.positional_density import NeighbourSum

    rng = np.random.default_rng(1)
    position = rng.uniform(-1, 1, (500, 3)).astype(np.float32)
    own_normal = _unit(rng.normal(size=(500, 3)))
    weight = rng.uniform(0, 1, (500, 3)).astype(np.float32)
    query = rng.uniform(-1.2, 1.2, (60, 3)).astype(np.float32)
    normal = _unit(rng.normal(size=(60, 3)))
    result = NeighbourSum(position, own_normal, weight, 0.4)(query, normal)
    near = np.linalg.norm(position[None] - query[:, None], axis=-1) < 0.4
    front = normal @ own_normal.T > 0.5
    np.testing.assert_allclose(result, (near & front).astype(np.float32) @ weight, rtol=1e-5)


def _unit(v: np.ndarray) -> np.ndarray:
    return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)
