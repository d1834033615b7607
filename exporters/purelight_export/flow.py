"""The normalizing flow as a graph piece; `purelight_train.networks.coupling_flow` defines it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from purelight_export.encodings import Features, mlp, one_blob
from purelight_export.graph import Graph, Value
from purelight_train.networks.coupling_flow import (
    BLOB_BINS,
    MIN_HEIGHT,
    MIN_WIDTH,
    Coupling,
    CouplingFlow,
)


class Spline:
    """One piecewise-quadratic CDF on [0, 1] per row, with floored bins, from logits [N, 2K + 1].

    Only the bin that holds the argument is normalised, wherever that is possible.
    """

    def __init__(self, graph: Graph, logits: Value) -> None:
        bins = (logits.shape[0] - 1) // 2
        self.graph = graph
        widths, heights = graph.split(logits, [bins, bins + 1])
        self.width = graph.softmax(widths) * (1 - bins * MIN_WIDTH) + MIN_WIDTH
        self.raw = graph.softmax(heights)
        left, right = graph.slice(self.raw, 0, bins), graph.slice(self.raw, 1, bins + 1)
        double_area = (left + right) * self.width
        self.scale = (1 - MIN_HEIGHT) / graph.sum(double_area)
        self.edge = graph.cumulative_sum(self.width, exclusive=True)
        self.area = graph.cumulative_sum(double_area, exclusive=True)

    def _bin(self, index: Value) -> tuple[Value, Value, Value, Value, Value]:
        """Start, width, CDF, left and right height of a bin; each [N, 1]."""
        graph = self.graph
        start, width, area, left = (
            graph.pick(values, index) for values in (self.edge, self.width, self.area, self.raw)
        )
        right, double = graph.pick(self.raw, index + 1), 2.0 * self.scale
        cdf = area * self.scale + start * MIN_HEIGHT
        return start, width, cdf, left * double + MIN_HEIGHT, right * double + MIN_HEIGHT

    def _last(self, reached: Value) -> Value:
        """Index of the last knot that is reached: [N, K] -> [N, 1]."""
        return self.graph.sum(self.graph.cast(reached, np.int32)) - 1

    def forward(self, x: Value) -> tuple[Value, Value]:
        """CDF and density at x: [N, 1] -> [N, 1], [N, 1]."""
        start, width, cdf, left, right = self._bin(self._last(x >= self.edge))
        a = self.graph.clip((x - start) / width, 0.0, 1.0)
        rise = a * (right - left)
        u = cdf + width * a * (left + 0.5 * rise)
        return self.graph.clip(u, 0.0, 1.0), left + rise

    def inverse(self, u: Value) -> Value:
        """Point whose CDF is u, by the root that is free of cancellation: [N, 1] -> [N, 1]."""
        graph = self.graph
        knots = self.area * self.scale + self.edge * MIN_HEIGHT
        start, width, cdf, left, right = self._bin(self._last(u >= knots))
        r = graph.relu((u - cdf) / width)
        root = graph.sqrt(graph.relu(left * left + 2.0 * (right - left) * r))
        a = graph.clip(2.0 * r / (left + root), 0.0, 1.0)
        return graph.clip(start + a * width, 0.0, 1.0)


def flow_sample(
    graph: Graph,
    start: Sequence[Value],
    context: Features,
    flow: CouplingFlow,
    unchanged: Value | None = None,
) -> list[Value]:
    """Uniform coordinates to those of a point of the square, each [N, 1].

    Arguments:
        unchanged: [N, 1] rows that keep their start. At the end they condition the last coupling
            like any other row, so `flow_density` of the result shares that coupling's network.
    """
    point = list(start)
    for layer in reversed(_couplings(flow)):
        moved = _spline(graph, layer, point, context).inverse(point[layer.dimension])
        if unchanged is not None:
            moved = graph.where(unchanged, start[layer.dimension], moved)
        point[layer.dimension] = moved
    return point


def flow_density(
    graph: Graph, point: Sequence[Value], context: Features, flow: CouplingFlow
) -> Value:
    """Density at points of the square with respect to area: two [N, 1] -> [N, 1].

    The floors bound each factor to [1e-3, 1e3], so the product needs no logarithm.
    """
    point = list(point)
    density: Value | None = None
    for layer in _couplings(flow):
        spline = _spline(graph, layer, point, context)
        point[layer.dimension], factor = spline.forward(point[layer.dimension])
        density = factor if density is None else density * factor
    assert density is not None
    return density


def _couplings(flow: CouplingFlow) -> list[Coupling]:
    return [layer for layer in flow.couplings if isinstance(layer, Coupling)]


def _spline(graph: Graph, layer: Coupling, point: Sequence[Value], context: Features) -> Spline:
    other = one_blob(graph, point[1 - layer.dimension], BLOB_BINS)
    return Spline(graph, mlp(graph, [context, other], layer.network))
