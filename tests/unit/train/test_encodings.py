"""Encodings: harmonics are orthonormal, grids interpolate, gradients are right."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from purelight_train.networks.encodings import (
    MLP,
    GridEncoding,
    SphericalHarmonics,
    WeightedLookup,
    monomial_exponents,
    one_blob,
)


@pytest.mark.parametrize("degree", [1, 3, 5])
def test_harmonics_are_orthonormal(degree: int) -> None:
    """The integral of Y_i Y_j over the sphere is the identity, by a product quadrature."""
    nodes, weight = (torch.from_numpy(a) for a in np.polynomial.legendre.leggauss(12))
    phi = (torch.arange(24, dtype=torch.float64) + 0.5) * (2 * math.pi / 24)
    z, phi = (a.reshape(-1) for a in torch.meshgrid(nodes, phi, indexing="ij"))
    rho = torch.sqrt(1 - z * z)
    direction = torch.stack((rho * torch.cos(phi), rho * torch.sin(phi), z), -1)
    value = SphericalHarmonics(degree).double()(direction)
    gram = value.T @ (value * weight.repeat_interleave(24)[:, None] * (2 * math.pi / 24))
    torch.testing.assert_close(gram, torch.eye(degree**2, dtype=torch.float64), atol=1e-6, rtol=0)


def test_monomials_span_every_band() -> None:
    for degree in range(1, 6):
        exponents = monomial_exponents(degree)
        assert len(set(exponents)) == degree**2
        assert all(c <= 1 and a + b + c < degree for a, b, c in exponents)


@pytest.mark.parametrize("table_size", [1 << 10, 1 << 14])
def test_dense_levels_reproduce_linear_functions(table_size: int) -> None:
    """Trilinear interpolation of a linear function is exact, at corners and faces too."""
    grid = GridEncoding(1, 1, 8, 8, table_size).double()
    assert grid.dense == [True]
    axis = torch.arange(9, dtype=torch.float64) / 8
    z, y, x = torch.meshgrid(axis, axis, axis, indexing="ij")
    grid.table.data = (x + 2 * y - 3 * z).reshape(-1, 1)
    edge = torch.tensor([[0.0, 0, 0], [1, 1, 1], [1, 0, 0.5]])
    point = torch.cat((edge, torch.rand(200, 3, generator=torch.Generator().manual_seed(0))))
    point = point.double()
    expected = point @ torch.tensor([1.0, 2.0, -3.0], dtype=torch.float64)
    torch.testing.assert_close(grid(point)[:, 0], expected, atol=1e-12, rtol=0)


def test_hashed_level_stays_in_its_table() -> None:
    grid = GridEncoding(3, 2, 4, 64, 1 << 8)
    point = torch.rand(500, 3, generator=torch.Generator().manual_seed(1))
    index, weight = (t.view(500, 3, 8) for t in grid.corners(point))
    ends = [*grid.offsets, len(grid.table)]
    for level in range(3):
        assert index[:, level].min() >= ends[level]
        assert index[:, level].max() < ends[level + 1]
    torch.testing.assert_close(weight.sum(2), torch.ones(500, 3))
    assert grid.dense == [True, False, False]


@pytest.mark.parametrize("count", [0, 1, 15, 16, 17, 32, 512])
def test_a_row_is_the_same_in_any_batch(count: int) -> None:
    """Rows that are added for the cache's sake are in no result."""
    torch.manual_seed(0)
    grid = GridEncoding(4, 2, 4, 40, 1 << 10)
    point = torch.rand(600, 3)
    whole, some = grid.corners(point), grid.corners(point[:count])
    for every, part in zip(whole, some, strict=True):
        assert part.shape == (4 * count, 8)
        assert torch.equal(part, every[: 4 * count])
    assert grid(point[:count]).shape == (count, grid.size)


def test_lookup_gradient_matches_plain_indexing() -> None:
    generator = torch.Generator().manual_seed(2)
    table = torch.randn(20, 3, generator=generator, requires_grad=True)
    index = torch.randint(0, 20, (50, 8), generator=generator)
    weight = torch.rand(50, 8, generator=generator)
    twin = table.detach().clone().requires_grad_()
    (WeightedLookup.apply(table, index, weight) ** 2).sum().backward()
    ((twin[index] * weight[..., None]).sum(1) ** 2).sum().backward()
    torch.testing.assert_close(table.grad, twin.grad)


def test_mixed_precision_is_for_training_only() -> None:
    torch.manual_seed(0)
    network = MLP(8, 3, 32, 2)
    x = torch.randn(64, 8)
    exact = network(x)
    network.mixed = True
    rounded = network(x)
    assert rounded.dtype == torch.float32
    assert 0 < float((rounded - exact).abs().max()) < 2e-2
    rounded.sum().backward()
    assert all(p.grad is not None and p.grad.dtype == torch.float32 for p in network.parameters())
    torch.testing.assert_close(network.eval()(x), exact, atol=0, rtol=0)


def test_one_blob_peaks_in_its_bin() -> None:
    value = one_blob(torch.tensor([0.0, 0.55, 1.0]), 10)
    assert value.argmax(1).tolist() == [0, 5, 9]
    assert float(value[1, 5]) == pytest.approx(1.0)
