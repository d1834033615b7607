"""Graph pieces against the formulas they stand for, in float64 where there is a NumPy reference."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import torch
from torch import nn

from purelight_export.encodings import Features, harmonics, mlp, one_blob
from purelight_export.flow import flow_density, flow_sample
from purelight_export.graph import Graph, Value
from purelight_export.grid import grid
from purelight_train.networks import encodings
from purelight_train.networks.coupling_flow import CouplingFlow

Run = Callable[..., np.ndarray]
Unit = Callable[..., np.ndarray]


def unfolded(graph: Graph, features: Features) -> Value:
    """The features themselves, by the linear layer that would absorb their affine map."""
    return graph.linear(features.value, features.matrix, features.offset)


def square(count: int = 2000) -> np.ndarray:
    u = np.random.default_rng(5).random((count, 2))
    u[:7] = [[0, 0], [1, 1], [0.5, 0.5], [0, 0.5], [0.5, 1], [1 - 2**-24, 0], [0.25, 0.25]]
    return u.astype(np.float32)


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
