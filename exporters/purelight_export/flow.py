"""The normalizing flow as a graph piece; `purelight_train.coupling_flow` defines it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from purelight_train.coupling_flow import (
    BLOB_BINS,
    MIN_HEIGHT,
    MIN_WIDTH,
    Coupling,
    CouplingFlow,
)

from purelight_export.encodings import Features, join, mlp, one_blob
from purelight_export.graph import Graph, Value


class Spline:
    """One piecewise-quadratic CDF on [0, 1] per row, with floored bins, from logits [N, 2K + 1]."""

    def __init__(self, graph: Graph, logits: Value) -> None:
        bins = (logits.shape[0] - 1) // 2
        self.graph = graph
        widths, heights = graph.split(logits, [bins, bins + 1])
        self.width = graph.softmax(widths) * (1 - bins * MIN_WIDTH) + MIN_WIDTH
        raw = graph.softmax(heights)
        left, right = graph.slice(raw, 0, bins), graph.slice(raw, 1, bins + 1)
        area = (left + right) * self.width * 0.5
        scale = (1 - MIN_HEIGHT) / graph.sum(area)
        self.height = raw * scale + MIN_HEIGHT
        self.edge = graph.cumulative_sum(self.width, exclusive=True)
        cell = area * scale + self.width * MIN_HEIGHT
        self.cdf = graph.cumulative_sum(cell, exclusive=True)

    def _bin(self, x: Value, knots: Value) -> tuple[Value, Value, Value, Value, Value]:
        """Start, width, CDF, left and right height of the bin that holds x; each [N, 1]."""
        graph = self.graph
        index = graph.sum(graph.cast(x >= knots, np.int32)) - 1
        start, width, cdf, left = (
            graph.pick(values, index) for values in (self.edge, self.width, self.cdf, self.height)
        )
        return start, width, cdf, left, graph.pick(self.height, index + 1)

    def forward(self, x: Value) -> tuple[Value, Value]:
        """CDF and density at x: [N, 1] -> [N, 1], [N, 1]."""
        start, width, cdf, left, right = self._bin(x, self.edge)
        a = self.graph.clip((x - start) / width, 0.0, 1.0)
        rise = a * (right - left)
        u = cdf + width * a * (left + 0.5 * rise)
        return self.graph.clip(u, 0.0, 1.0), left + rise

    def inverse(self, u: Value) -> tuple[Value, Value]:
        """Point whose CDF is u, and the density there: [N, 1] -> [N, 1], [N, 1]."""
        graph = self.graph
        start, width, cdf, left, right = self._bin(u, self.cdf)
        r = graph.relu((u - cdf) / width)
        slope = right - left
        root = graph.sqrt(graph.relu(left * left + 2.0 * slope * r))
        a = graph.clip(2.0 * r / (left + root), 0.0, 1.0)
        return graph.clip(start + a * width, 0.0, 1.0), left + a * slope


def flow_sample(graph: Graph, u: Value, context: Features, flow: CouplingFlow) -> list[Value]:
    """Uniform u [N, 2] to a point of the square: its coordinates and density, each [N, 1]."""
    layers = list(reversed(list(flow.couplings)))
    return _run(graph, u, context, layers, Spline.inverse)


def flow_density(graph: Graph, z: Value, context: Features, flow: CouplingFlow) -> Value:
    """Density at points z [N, 2] of the square with respect to area: [N, 1]."""
    return _run(graph, z, context, list(flow.couplings), Spline.forward)[2]


def _run(
    graph: Graph,
    point: Value,
    context: Features,
    layers: list,
    warp: Callable[[Spline, Value], tuple[Value, Value]],
) -> list[Value]:
    """Applies couplings in turn; the density is the product of the splines' densities.

    The floors bound each factor to [1e-3, 1e3], so the product needs no logarithm.
    """
    coordinates = graph.columns(graph.clip(point, 0.0, 1.0))
    density: Value | None = None
    for layer in layers:
        assert isinstance(layer, Coupling)
        other = one_blob(graph, coordinates[1 - layer.dimension], BLOB_BINS)
        spline = Spline(graph, mlp(graph, join(graph, [context, other]), layer.network))
        coordinates[layer.dimension], factor = warp(spline, coordinates[layer.dimension])
        density = factor if density is None else density * factor
    assert density is not None
    return [*coordinates, density]
