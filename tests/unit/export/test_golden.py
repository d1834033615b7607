"""Golden vectors and the probes they are chosen from."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from purelight_export import networks
from purelight_export.graph import Graph
from purelight_format.errors import PureLightError
from purelight_format.networks import probes
from purelight_format.networks.golden import COUNT, FLOOR, VALUES, golden_vectors
from purelight_onnx.session import Session
from purelight_train.light.description import Description
from purelight_train.networks.fast_map import FastMap
from purelight_train.networks.sampler import Sampler
from purelight_train.presets import Preset


def step() -> bytes:
    """transmittance = 1 where the x of the position is above 0.5, else x."""
    graph = Graph("transparency")
    position = graph.input("position", 3)
    graph.input("normal", 3)
    graph.input("outgoing", 3)
    graph.output("transmittance", graph.where(position > 0.5, 1.0, position))
    return graph.to_bytes()


def extent(description: Description) -> probes.Extent:
    """A lamp of two triangles along the x axis, and one between them without area."""
    positions = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
    triangles = np.array([[0, 1, 2], [1, 2, 1], [0, 1, 3]])
    return probes.Extent(positions, triangles, description.sphere, 15.0)


def candidates(x: np.ndarray) -> dict[str, np.ndarray]:
    position = np.repeat(x[:, None], 3, 1)
    return {"position": position, "normal": position, "outgoing": position}


def test_the_first_candidates_are_taken() -> None:
    x = np.linspace(0.1, 0.4, 100)
    vectors = golden_vectors("transparency", step(), candidates(x), {"transmittance": 1.0})
    assert len(vectors) == COUNT
    np.testing.assert_array_equal(vectors.inputs["position"][:, 0], x[:COUNT].astype(np.float32))
    tolerance = vectors.tolerances["transmittance"][:, 0]
    assert (tolerance >= FLOOR).all()
    assert (tolerance < 2 * FLOOR).all()


def test_a_candidate_that_rounding_decides_is_left_out() -> None:
    x = np.full(COUNT + 1, 0.25)
    x[7] = 0.5
    vectors = golden_vectors("transparency", step(), candidates(x), {"transmittance": 0.0})
    assert (vectors.inputs["position"] == 0.25).all()


def test_too_few_good_candidates_are_an_error() -> None:
    x = np.full(COUNT, 0.5)
    with pytest.raises(PureLightError, match="transparency"):
        golden_vectors("transparency", step(), candidates(x), {"transmittance": 0.0})


def test_maps_have_fewer_vectors(description: Description, preset: Preset, wild: Any) -> None:
    model = networks.fast_map(wild(FastMap, description, preset))
    probe = probes.point_probes(extent(description), 64, np.random.default_rng(0))
    vectors = golden_vectors("fast_map", model, probe, {"radiance_map": 1.0})
    assert len(vectors) == 21
    assert len(vectors) * 16 * 16 * 3 <= VALUES
    assert len(vectors) > len(probes.EDGE_RADII)


def test_float32_meets_the_vectors_of_a_sampler(
    description: Description, preset: Preset, wild: Any
) -> None:
    model = networks.sampler(wild(Sampler, description, preset))
    probe = probes.sampler_probes(extent(description), 256, np.random.default_rng(0))
    vectors = golden_vectors("sampler", model, probe, {"toward": 1.0, "pdf_solid_angle": 0.0})
    result = Session(model)(vectors.inputs)
    for name, expected in vectors.outputs.items():
        error = np.abs(result[name] - expected)
        assert (error <= vectors.tolerances[name]).all()
        assert vectors.tolerances[name].max() <= 0.1 * np.abs(expected).max()


def test_surface_probes_lie_on_the_surface(description: Description) -> None:
    probe = probes.surface_probes(extent(description), 400, np.random.default_rng(0))
    assert (np.abs(probe["position"][:, 1:]).min(1) < 1e-6).all()
    for name in ("normal", "outgoing"):
        np.testing.assert_allclose(np.linalg.norm(probe[name], axis=1), 1, atol=1e-6)
    cosine = (probe["normal"] * probe["outgoing"]).sum(1)
    assert (cosine > 0).all()
    assert cosine[::8].max() < 2e-3


def test_points_begin_with_the_edges(description: Description) -> None:
    sphere = description.sphere
    points = probes.points(sphere, 15.0, 64, np.random.default_rng(0)).astype(np.float64)
    radii = np.linalg.norm(points - sphere.center, axis=1) / sphere.radius
    edges = np.array(probes.EDGE_RADII)
    np.testing.assert_allclose(radii[: len(edges)], edges, rtol=1e-5, atol=1e-6)
    assert radii[len(edges) :].min() > 1
    assert radii[len(edges) :].max() < 30
