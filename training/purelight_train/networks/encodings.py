"""Input encodings: one-blob, real spherical harmonics, and multi-resolution grids.

All of them are plain sums and products, so the exporter writes them as ONNX operators.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import accumulate, pairwise
from operator import mul
from typing import Any

import numpy as np
import torch
from scipy.sparse import csr_matrix
from scipy.special import sph_harm_y
from torch import Tensor, nn

HASH_PRIMES = (1, 2_654_435_761, 805_459_861)
LINE = 16  # floats of a line of a cache


def one_blob(x: Tensor, bins: int) -> Tensor:
    r"""One-blob encoding :math:`\exp(-\tfrac12 (k x - i - \tfrac12)^2)` (Mueller 2019, Sec. 4.3).

    Arguments:
        x: [...] in [0, 1].
        bins: number of bins k; the Gaussian's deviation is one bin.

    Returns:
        [..., bins].
    """
    centre = torch.arange(bins, dtype=x.dtype, device=x.device) + 0.5
    return torch.exp(-0.5 * (x[..., None] * bins - centre) ** 2)


def monomial_exponents(degree: int) -> list[tuple[int, int, int]]:
    """Exponents (a, b, c), c <= 1, a+b+c < degree: a basis of all harmonics below `degree`.

    On the unit sphere z² = 1 - x² - y², so degree² monomials span the degree² harmonics.
    """
    return [
        (a, n - a - c, c) for n in range(degree) for c in (0, 1) if c <= n for a in range(n - c + 1)
    ]


def monomials(direction: Tensor, degree: int) -> Tensor:
    """Monomials of a unit vector, in the order of `monomial_exponents`: [N, 3] -> [N, degree²]."""
    x, y, z = direction.unbind(-1)
    one = torch.ones_like(x)
    powers_x, powers_y = ([*accumulate([v] * (degree - 1), mul, initial=one)] for v in (x, y))
    columns = [
        powers_x[a] * powers_y[b] * (z if c else one) for a, b, c in monomial_exponents(degree)
    ]
    return torch.stack(columns).movedim(0, -1)  # Written a column at a time


@cache
def harmonics_matrix(degree: int) -> np.ndarray:
    """Matrix M with `harmonics = monomials @ M.T`, real orthonormal harmonics: [degree², degree²].

    Solved once in float64 from SciPy's complex harmonics; exact to rounding.
    """
    rng = np.random.default_rng(0)
    v = rng.normal(size=(8 * degree * degree, 3))
    v /= np.linalg.norm(v, axis=1, keepdims=True)
    theta, phi = np.arccos(v[:, 2]), np.arctan2(v[:, 1], v[:, 0])
    columns = []
    for n in range(degree):
        for m in range(-n, n + 1):
            y = sph_harm_y(n, abs(m), theta, phi)
            real = y.real if m >= 0 else y.imag
            columns.append(real if m == 0 else math.sqrt(2) * real)
    basis = monomials(torch.from_numpy(v), degree).numpy()
    return np.linalg.lstsq(basis, np.stack(columns, 1), rcond=None)[0].T


class SphericalHarmonics(nn.Module):
    """Real spherical harmonics of a unit vector up to `degree` bands: [N, 3] -> [N, degree²].

    "Degree five" in the paper means five bands, l = 0..4, hence 25 values.
    """

    matrix: Tensor

    def __init__(self, degree: int) -> None:
        super().__init__()
        self.degree = degree
        self.register_buffer(
            "matrix", torch.tensor(harmonics_matrix(degree), dtype=torch.float32), persistent=False
        )

    @property
    def size(self) -> int:
        return self.degree**2

    def forward(self, direction: Tensor) -> Tensor:
        return monomials(direction, self.degree) @ self.matrix.T


class WeightedLookup(torch.autograd.Function):
    """Weighted sums of eight table rows, [T, F], [M, 8], [M, 8] -> [M, F]; gradient of the table.

    PyTorch's own backward pass sorts the indices; a sparse product is some 20 times faster.
    """

    @staticmethod
    def forward(ctx: Any, table: Tensor, index: Tensor, weight: Tensor) -> Tensor:
        ctx.save_for_backward(index, weight)
        ctx.rows = table.shape[0]
        return nn.functional.embedding_bag(index, table, per_sample_weights=weight, mode="sum")

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor, None, None]:
        index, weight = ctx.saved_tensors
        if gradient.is_cuda:
            values = (gradient[:, None, :] * weight[:, :, None]).reshape(-1, gradient.shape[-1])
            zero = gradient.new_zeros(ctx.rows, gradient.shape[-1])
            return zero.index_add_(0, index.reshape(-1), values), None, None
        start = np.arange(0, index.numel() + 1, 8)
        matrix = csr_matrix(
            (weight.numpy().reshape(-1), index.numpy().reshape(-1), start),
            shape=(len(index), ctx.rows),
        )
        return torch.from_numpy(matrix.T @ gradient.contiguous().numpy()), None, None


class GridEncoding(nn.Module):
    r"""Multi-resolution grid of features with trilinear interpolation (Mueller 2022).

    Level l has :math:`r_l = \lfloor b\,g^l \rfloor` cells along each axis. A level whose
    (r_l + 1)³ vertices fit `table_size` is dense, index (z (r+1) + y)(r+1) + x; others hash by
    (x + p1 y + p2 z) mod T: additive, so that hosts without integer XOR can evaluate it.

    Arguments:
        levels: number of levels.
        features: features per level.
        base: cells of the coarsest level.
        finest: cells of the finest level.
        table_size: most entries per level, a power of two.
    """

    def __init__(self, levels: int, features: int, base: int, finest: int, table_size: int) -> None:
        super().__init__()
        growth = (finest / base) ** (1 / max(levels - 1, 1))
        self.levels, self.features, self.table_size = levels, features, table_size
        self.resolutions = [int(base * growth**level + 1e-6) for level in range(levels)]
        self.dense = [(r + 1) ** 3 <= table_size for r in self.resolutions]
        sizes = [
            (r + 1) ** 3 if dense else table_size
            for r, dense in zip(self.resolutions, self.dense, strict=True)
        ]
        self.offsets = [sum(sizes[:level]) for level in range(levels)]
        self.table = nn.Parameter(torch.empty(sum(sizes), features).uniform_(-1e-2, 1e-2))
        self._planned: tuple[Tensor, ...] = ()

    @property
    def size(self) -> int:
        return self.levels * self.features

    def strides(self, level: int) -> tuple[int, int, int]:
        """Index stride of each axis at `level` (dense strides, or centred hash residues)."""
        if self.dense[level]:
            r = self.resolutions[level] + 1
            return 1, r, r * r
        half = self.table_size // 2
        centred = [(p + half) % self.table_size - half for p in HASH_PRIMES]
        return centred[0], centred[1], centred[2]

    def _plan(self, device: torch.device) -> tuple[Tensor, ...]:
        """Per level: resolution, axis strides [L, 3], corner offsets [L, 8], mask and first row.

        They are kept where they were last asked for: a copy to a GPU makes it wait.
        """
        if self._planned and self._planned[0].device == device:
            return self._planned
        strides = torch.tensor([self.strides(level) for level in range(self.levels)])
        corner = torch.tensor([(k & 1, k >> 1 & 1, k >> 2) for k in range(8)])
        mask = [-1 if dense else self.table_size - 1 for dense in self.dense]
        whole = (strides, strides @ corner.T, torch.tensor(mask), torch.tensor(self.offsets))
        plan = (torch.tensor(self.resolutions, dtype=torch.float32), *(t.int() for t in whole))
        self._planned = tuple(t.to(device) for t in plan)
        return self._planned

    def corners(self, x: Tensor) -> tuple[Tensor, Tensor]:
        """Table rows and trilinear weights of each level's corners: [N, 3] -> two of [N L, 8].

        The rows lie along the last axis meanwhile, which is far faster than along the first. Of
        2^k rows one set of a cache would hold all that belongs to one of them, so some are added.
        """
        resolution, strides, corner, mask, offset = self._plan(x.device)
        resolution = resolution.to(x.dtype)[:, None, None]
        lines = -(-len(x) // LINE) | 1
        padded = nn.functional.pad(x.clamp(0, 1).t(), (0, LINE * lines - len(x)))
        scaled = padded * resolution
        low = torch.minimum(scaled.floor(), resolution - 1)
        high = scaled - low
        first = (low.int() * strides[:, :, None]).sum(1, dtype=torch.int32)
        index = (first[:, None] + corner[:, :, None]) & mask[:, None, None]
        index += offset[:, None, None]
        x_side, y_side, z_side = torch.stack((1 - high, high), 2).unbind(1)
        weight = z_side[:, :, None, None] * y_side[:, None, :, None] * x_side[:, None, None, :]
        both = index, weight.reshape(self.levels, 8, -1)
        rows, weights = (part[..., : len(x)].permute(2, 0, 1).reshape(-1, 8) for part in both)
        return rows, weights

    def forward(self, x: Tensor) -> Tensor:
        """Encode positions: [N, 3] in [0, 1] -> [N, levels · features]."""
        index, weight = self.corners(x)
        value: Tensor = WeightedLookup.apply(self.table, index, weight.to(self.table.dtype))
        return value.view(-1, self.size)


class MLP(nn.Sequential):
    """ReLU network with `depth` hidden layers of `width` neurons: [N, inputs] -> [N, outputs].

    If `mixed`, its products run in bfloat16 while it is trained; weights, results and all else
    (encodings, splines, losses) stay in float32.
    """

    def __init__(self, inputs: int, outputs: int, width: int, depth: int) -> None:
        sizes = [inputs] + [width] * depth
        layers: list[nn.Module] = []
        for fan_in, fan_out in pairwise(sizes):
            layers += [nn.Linear(fan_in, fan_out), nn.ReLU()]
        super().__init__(*layers, nn.Linear(sizes[-1], outputs))
        self.mixed = False

    def forward(self, x: Tensor) -> Tensor:
        if not (self.mixed and self.training):
            result: Tensor = super().forward(x)
            return result
        with torch.autocast(x.device.type, torch.bfloat16):
            return super().forward(x).to(x.dtype)
