"""Graph pieces against the formulas they stand for, in float64 where there is a NumPy reference."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import nn

from purelight_export import geometry as graph_geometry
from purelight_export.encodings import Features, harmonics, mlp, one_blob
from purelight_export.flow import flow_density, flow_sample
from purelight_export.graph import Graph, Value
from purelight_export.grid import grid
from purelight_format import measures
from purelight_format.measures import BoundingSphere
from purelight_train.networks import encodings
from purelight_train.networks.coupling_flow import CouplingFlow

Run = Callable[..., np.ndarray]
Unit = Callable[..., np.ndarray]

SPHERE = BoundingSphere((1.0, 2.0, -3.0), 0.5)


def unfolded(graph: Graph, features: Features) -> Value:
    """The features themselves, by the linear layer that would absorb their affine map."""
    return graph.linear(features.value, features.matrix, features.offset)


def points(unit: Unit, count: int, seed: int = 3) -> np.ndarray:
    """Points outside the sphere: touching it, near, and up to 1e6 radii away."""
    distance = 1 + np.logspace(-4, 6, count)[:, None]
    return (np.array(SPHERE.center) + SPHERE.radius * distance * unit(count, seed)).astype("f4")


def test_frame(run: Run, unit: Unit) -> None:
    axis = np.concatenate([unit(500), [[1e-4, 0, -1], [0, -1e-6, -1], [1e-12, 0, -1]]])
    axis = axis.astype(np.float32)
    expected = measures.frame(axis.astype(np.float64))
    for k in (0, 1):
        result = run(lambda g, n, k=k: graph_geometry.frame(g, n)[k], axis)
        np.testing.assert_allclose(result, expected[k], atol=1e-6)


def square(count: int = 2000) -> np.ndarray:
    u = np.random.default_rng(5).random((count, 2))
    u[:7] = [[0, 0], [1, 1], [0.5, 0.5], [0, 0.5], [0.5, 1], [1 - 2**-24, 0], [0.25, 0.25]]
    return u.astype(np.float32)


def test_square_to_disk(run: Run) -> None:
    u = square()
    result = run(lambda g, x: g.concat(graph_geometry.square_to_disk(g, x)), u)
    np.testing.assert_allclose(result, measures.square_to_disk(u.astype(np.float64)), atol=5e-7)


def test_disk_to_square(run: Run) -> None:
    disk = measures.square_to_disk(square().astype(np.float64)).astype(np.float32)
    result = run(lambda g, p: graph_geometry.disk_to_square(g, *g.columns(p)), disk)
    np.testing.assert_allclose(result, measures.disk_to_square(disk.astype(np.float64)), atol=5e-7)


def to_cap(graph: Graph, point: Value, u: Value) -> Value:
    view = graph_geometry.cap(graph, point, SPHERE.center, SPHERE.radius)
    return graph.concat([graph_geometry.cap_to_direction(graph, u, view), view.one_minus_cos])


def test_cap_to_direction(run: Run, unit: Unit) -> None:
    u, point = square(), points(unit, 2000)
    cap = measures.cap(point.astype(np.float64), SPHERE)
    expected = measures.cap_to_direction(u.astype(np.float64), cap)
    result = run(to_cap, point, u)
    np.testing.assert_allclose(result[:, :3], expected, atol=1e-3)
    far = np.linalg.norm(point - SPHERE.center, axis=1) > 1.01 * SPHERE.radius
    np.testing.assert_allclose(result[far, :3], expected[far], atol=2e-6)
    np.testing.assert_allclose(result[far, 3], cap.one_minus_cos[far], rtol=2e-5)


def test_direction_to_cap(run: Run, unit: Unit) -> None:
    u, point = 0.01 + 0.98 * square(), points(unit, 2000)
    near = np.linalg.norm(point - SPHERE.center, axis=1) < 1e3 * SPHERE.radius
    point, u = point[near], u[: near.sum()]
    cap = measures.cap(point.astype(np.float64), SPHERE)
    toward = measures.cap_to_direction(u.astype(np.float64), cap).astype(np.float32)

    def piece(graph: Graph, p: Value, t: Value) -> Value:
        view = graph_geometry.cap(graph, p, SPHERE.center, SPHERE.radius)
        back, inside = graph_geometry.direction_to_cap(graph, t, view)
        return graph.concat([back, graph.cast(inside, np.float32)])

    result = run(piece, point, toward)
    angle = np.sqrt(cap.one_minus_cos)
    assert (np.abs(result[:, :2] - u).max(1) * angle).max() < 2e-5
    wide = (angle > 1e-2) & (np.abs(u - 0.5).max(1) < 0.45)
    assert result[wide, 2].all()


def test_a_direction_beside_the_cap_is_outside(run: Run) -> None:
    point, toward = np.array([[1.0, 2.0, -1.0]]), np.array([[0.0, 0.3, -np.sqrt(0.91)]])

    def piece(graph: Graph, p: Value, t: Value) -> Value:
        view = graph_geometry.cap(graph, p, SPHERE.center, SPHERE.radius)
        return graph.cast(graph_geometry.direction_to_cap(graph, t, view)[1], np.float32)

    assert run(piece, point, toward)[0, 0] == 0
    assert run(piece, point, np.array([[0.0, 0.2, -np.sqrt(0.96)]]))[0, 0] == 1


@pytest.mark.parametrize("columns", [1, 3])
def test_one_blob(run: Run, columns: int) -> None:
    x = np.random.default_rng(0).random((100, columns))
    result = run(lambda g, v: unfolded(g, one_blob(g, v, 8)), x)
    expected = encodings.one_blob(torch.from_numpy(x), 8).numpy().reshape(100, -1)
    np.testing.assert_allclose(result, expected, atol=1e-5)


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
def test_harmonics(run: Run, unit: Unit, degree: int) -> None:
    direction = unit(200)
    result = run(lambda g, d: unfolded(g, harmonics(g, d, degree)), direction)
    expected = encodings.SphericalHarmonics(degree)(torch.from_numpy(direction)).numpy()
    np.testing.assert_allclose(result, expected, atol=2e-6)


GRIDS = [(1, 1, 3, 3, 64), (4, 2, 4, 40, 1 << 12), (3, 3, 2, 9, 1 << 9), (5, 4, 8, 64, 1 << 13)]


@pytest.mark.parametrize("size", GRIDS)
@pytest.mark.parametrize("compact", [False, True])
def test_grid(run: Run, size: tuple[int, ...], compact: bool) -> None:
    encoding = encodings.GridEncoding(*size)
    nn.init.uniform_(encoding.table, -1, 1)
    x = np.random.default_rng(1).uniform(-0.1, 1.1, (500, 3)).astype(np.float32)
    x[:4] = [[0, 0, 0], [1, 1, 1], [0.5, 0.5, 0.5], [1, 0, 0.25]]
    result = run(lambda g, v: unfolded(g, grid(g, v, encoding, compact=compact)), x)
    expected = encoding(torch.from_numpy(x)).detach().numpy()
    np.testing.assert_allclose(result, expected, atol=4e-5 if compact else 2e-6)


def test_mlp(run: Run) -> None:
    network = encodings.MLP(9, 4, 16, 3)
    direction = np.random.default_rng(2).standard_normal((50, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    result = run(lambda g, d: mlp(g, [harmonics(g, d, 3)], network), direction)
    features = encodings.SphericalHarmonics(3)(torch.from_numpy(direction).float())
    np.testing.assert_allclose(result, network(features).detach().numpy(), atol=1e-6)


@pytest.mark.parametrize("sharpness", [0.0, 1.0, 20.0])
def test_flow(run: Run, sharpness: float) -> None:
    flow = CouplingFlow(3, 3, 16, 2, 16)
    for layer in flow.couplings:
        nn.init.normal_(layer.network[-1].weight, 0, 0.5 * sharpness)
        nn.init.normal_(layer.network[-1].bias, 0, 0.5 * sharpness)
    u, condition = square(), np.random.default_rng(4).standard_normal((2000, 3))

    def context(value: Value) -> Features:
        return Features(value, np.eye(3), np.zeros(3))

    def sample(graph: Graph, x: Value, c: Value) -> Value:
        z = flow_sample(graph, graph.columns(x), context(c), flow)
        return graph.concat([*z, flow_density(graph, z, context(c), flow)])

    z = run(sample, u, condition)
    with torch.no_grad():
        tensors = torch.from_numpy(u).double(), torch.from_numpy(condition).double()
        expected, log_density = flow.double().sample(*tensors)
    assert np.isfinite(z).all()
    assert (z[:, :2] >= 0).all()
    assert (z[:, :2] <= 1).all()
    assert (z[:, 2] > 0).all()
    if sharpness < 2:
        np.testing.assert_allclose(z[:, :2], expected.numpy(), atol=1e-5)
        np.testing.assert_allclose(z[:, 2], log_density.exp().numpy(), rtol=1e-3)
