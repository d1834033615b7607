"""The histogram sampler (`purelight_train.ablations.histogram_sampler`) as ONNX."""

from __future__ import annotations

import numpy as np

from purelight_export.encodings import join, mlp, one_blob
from purelight_export.graph import Graph, Value
from purelight_export.grid import grid
from purelight_format.measures import Cap, cap, cap_to_direction, direction_to_cap, encode_point
from purelight_train.ablations.histogram_sampler import HistogramSampler
from purelight_train.networks.fast_map import SIZE
from purelight_train.networks.point_encoding import ANGLE_BINS

BELOW_ONE = 1 - 2**-24


def sampler(network: HistogramSampler) -> bytes:
    """point [N, 3], u [N, 2] -> toward [N, 3], pdf_solid_angle [N]."""
    graph = Graph("sampler")
    point, u = graph.input("point", 3), graph.input("u", 2)
    view, share = _share(graph, point, network)
    b = network.uniform_fraction
    first, second = graph.columns(u)
    uniform = first < b
    first = graph.where(uniform, first * (1 / b), (first - b) * (1 / (1 - b)))
    start = [graph.clip(x, 0.0, 1.0) for x in (first, second)]
    row, v = _invert(graph, graph.linear(share, _row_sums(), np.zeros(SIZE)), start[1])
    columns = row * SIZE + graph.constant(np.arange(SIZE)[None], np.int32)
    column, w = _invert(graph, graph.pick(share, columns), start[0])
    drawn = [(graph.cast(k, np.float32) + x) * (1 / SIZE) for k, x in ((column, w), (row, v))]
    z = [graph.where(uniform, a, d) for a, d in zip(start, drawn, strict=True)]
    toward = cap_to_direction(graph.concat(z), view)
    graph.output("toward", graph.where(view.outside, toward, view.axis))
    pdf = graph.where(view.outside, _pdf(graph, share, z, view, b), 0.0)
    graph.output("pdf_solid_angle", graph.flatten(pdf))
    return graph.to_bytes()


def sampler_pdf(network: HistogramSampler) -> bytes:
    """point, toward [N, 3] -> pdf_solid_angle [N]."""
    graph = Graph("sampler_pdf")
    point, toward = graph.input("point", 3), graph.input("toward", 3)
    view, share = _share(graph, point, network)
    z, inside = direction_to_cap(toward, view)
    pdf = _pdf(graph, share, graph.columns(z), view, network.uniform_fraction)
    graph.output("pdf_solid_angle", graph.flatten(graph.where(view.outside & inside, pdf, 0.0)))
    return graph.to_bytes()


def _share(graph: Graph, point: Value, network: HistogramSampler) -> tuple[Cap[Value], Value]:
    """The cap seen from a point, and the cells' shares of the light: [N, 256], row by row."""
    encoding = network.encoding
    view = cap(point, encoding.sphere)
    place, angle = encode_point(point, encoding.sphere, encoding.r_max)
    parts = [grid(graph, place, encoding.grid), one_blob(graph, angle, ANGLE_BINS)]
    return view, graph.softmax(mlp(graph, [join(graph, parts)], network.network))


def _row_sums() -> np.ndarray:
    """[16, 256] which adds up the columns of each row."""
    return np.kron(np.eye(SIZE), np.ones((1, SIZE))).astype(np.float32)


def _invert(graph: Graph, share: Value, u: Value) -> tuple[Value, Value]:
    """Cell that holds a uniform under shares [N, 16], and the place within it: [N, 1] each."""
    cumulative = graph.cumulative_sum(share)
    target = u * graph.slice(cumulative, SIZE - 1, SIZE)
    reached = target >= graph.slice(cumulative, 0, SIZE - 1)
    cell = graph.sum(graph.cast(reached, np.int32))
    own, end = graph.pick(share, cell), graph.pick(cumulative, cell)
    place = 1.0 - (end - target) / graph.maximum(own, 1e-30)
    return cell, graph.clip(place, 0.0, BELOW_ONE)


def _pdf(graph: Graph, share: Value, z: list[Value], view: Cap[Value], b: float) -> Value:
    """Density per solid angle of the defensive mixture: [N, 1]."""
    column, row = (
        graph.cast(graph.clip(graph.floor(x * SIZE), 0.0, SIZE - 1.0), np.int32) for x in z
    )
    density = graph.pick(share, row * SIZE + column) * (SIZE * SIZE)
    return (density * (1 - b) + b) / view.solid_angle
