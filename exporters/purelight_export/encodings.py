"""Input encodings and dense networks as graph pieces (`purelight_train.networks.encodings`)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import block_diag
from torch import nn

from purelight_export.graph import Graph, Value
from purelight_train.networks.encodings import harmonics_matrix, monomial_exponents


@dataclass(frozen=True)
class Features:
    """Encoded inputs up to a constant affine map, which the following linear layer absorbs.

    Arguments:
        value: [N, E].
        matrix: [D, E]; the features are `value @ matrix.T + offset`.
        offset: [D].
    """

    value: Value
    matrix: np.ndarray
    offset: np.ndarray


def plain(value: Value) -> Features:
    """Features that are the value itself."""
    size = value.shape[0]
    return Features(value, np.eye(size), np.zeros(size))


def join(graph: Graph, parts: Sequence[Features]) -> Features:
    """Features side by side."""
    if len(parts) == 1:
        return parts[0]
    value = graph.concat([part.value for part in parts])
    matrix = block_diag(*(part.matrix for part in parts))
    return Features(value, matrix, np.concatenate([part.offset for part in parts]))


def one_blob(graph: Graph, x: Value, bins: int) -> Features:
    r"""One-blob encoding :math:`\exp(-\tfrac12 (k x - i - \tfrac12)^2)` of each column.

    Arguments:
        x: [N, C] in [0, 1].

    Returns:
        [N, C bins], all bins of the first column first.
    """
    columns = x.shape[0]
    centre = np.tile(np.arange(bins) + 0.5, columns)
    weight = np.kron(np.eye(columns), np.full((bins, 1), bins))
    t = graph.linear(x, weight * math.sqrt(0.5), -centre * math.sqrt(0.5))
    return plain(graph.exp(-(t * t)))


def harmonics(graph: Graph, direction: Value, degree: int) -> Features:
    """Real spherical harmonics of unit vectors, bands 0 .. degree - 1, at most five."""
    value, exponents = _monomials(graph, direction, degree)
    order = [exponents.index(e) for e in monomial_exponents(degree)[1:]]
    matrix = harmonics_matrix(degree)
    columns = np.zeros((matrix.shape[0], len(exponents)))
    columns[:, order] = matrix[:, 1:]
    return Features(value, columns, matrix[:, 0].copy())


def _monomials(
    graph: Graph, direction: Value, degree: int
) -> tuple[Value, list[tuple[int, int, int]]]:
    """All monomials but 1: first degree, products of two of those, products of two of all."""
    value, exponents = direction, [(1, 0, 0), (0, 1, 0), (0, 0, 1)]
    wanted = monomial_exponents(degree)[1:]
    for _ in range(2):
        pairs = {}
        for (i, a), (j, b) in product(enumerate(exponents), repeat=2):
            pairs[(a[0] + b[0], a[1] + b[1], a[2] + b[2])] = (i, j)
        new = [e for e in wanted if e not in exponents and e in pairs]
        if new:
            left, right = (graph.gather_columns(value, [pairs[e][k] for e in new]) for k in (0, 1))
            value, exponents = graph.concat([value, left * right]), exponents + new
    return value, exponents


def linear_weights(layer: nn.Linear) -> tuple[np.ndarray, np.ndarray]:
    """Weight [out, in] and bias [out] of a layer in float64."""
    weight = layer.weight.detach().cpu().double().numpy()
    bias = layer.bias
    return weight, np.zeros(len(weight)) if bias is None else bias.detach().cpu().double().numpy()


def mlp(graph: Graph, parts: Sequence[Features], network: nn.Sequential) -> Value:
    """ReLU network over features side by side: -> [N, outputs].

    Its first layer absorbs the features' affine maps. It is written as a sum over the parts, so
    that networks which share a part and its weights (a flow run both ways) share that product.
    """
    layers = [layer for layer in network if isinstance(layer, nn.Linear)]
    x = _first_layer(graph, parts, *linear_weights(layers[0]))
    for layer in layers[1:]:
        x = graph.linear(graph.relu(x), *linear_weights(layer))
    return x


def _first_layer(
    graph: Graph, parts: Sequence[Features], weight: np.ndarray, bias: np.ndarray
) -> Value:
    ends = np.cumsum([len(part.offset) for part in parts])
    total: Value | None = None
    for part, block in zip(parts, np.split(weight, ends[:-1], 1), strict=True):
        offset = block @ part.offset + (bias if total is None else 0)
        term = graph.linear(part.value, block @ part.matrix, offset)
        total = term if total is None else total + term
    assert total is not None
    return total
