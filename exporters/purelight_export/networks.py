"""The networks of a bundle as ONNX, from the trained modules of `purelight_train`."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from torch import Tensor, nn

from purelight_export.encodings import Features, harmonics, join, mlp, one_blob
from purelight_export.flow import flow_density, flow_sample
from purelight_export.graph import Graph, Value
from purelight_export.grid import grid
from purelight_format.measures import (
    Cap,
    cap,
    cap_to_direction,
    direction_to_cap,
    encode_point,
    log_distance,
)
from purelight_train.light.description import Description
from purelight_train.networks.encodings import GridEncoding
from purelight_train.networks.fast_map import (
    BLOCKS,
    CELLS,
    MOST_GAIN,
    MOST_TINT,
    SIDE,
    SIZE,
    FastMap,
    hats,
)
from purelight_train.networks.point_encoding import ANGLE_BINS, PointEncoding
from purelight_train.networks.sampler import UNIFORM_FRACTION, Sampler
from purelight_train.networks.student import LEAST_LOG, MAX_LOG, Student
from purelight_train.networks.surface_network import SurfaceNetwork, lifted, refracted
from purelight_train.networks.transparency import Transparency
from purelight_train.presets import Preset


def appearance(student: Student, *, compact: bool = False) -> bytes:
    """position, normal, outgoing [N, 3] -> radiance [N, 3] in W/(m² sr)."""
    graph = Graph("appearance")
    ray = _ray(graph)
    raw = _surface(graph, student, *ray, compact=compact)
    gain = (student.gain.double() * student.scale * student.channels).cpu().numpy()
    bounded = graph.minimum(graph.maximum(raw, student.least_log), student.ceiling.cpu().numpy())
    exponential = graph.exp(bounded)
    unit = exponential if student.link == "log" else exponential - 1.0
    graph.output("radiance", unit * _tilt(graph, student, ray[2]) * gain)
    return graph.to_bytes()


def transparency(network: Transparency, *, compact: bool = False) -> bytes:
    """position, normal, outgoing [N, 3] -> transmittance [N, 3]."""
    graph = Graph("transparency")
    graph.output(
        "transmittance", graph.sigmoid(_surface(graph, network, *_ray(graph), compact=compact))
    )
    return graph.to_bytes()


def sampler(network: Sampler, *, compact: bool = False) -> bytes:
    """point [N, 3], u [N, 2] -> toward [N, 3], pdf_solid_angle [N]."""
    graph = Graph("sampler")
    point, u = graph.input("point", 3), graph.input("u", 2)
    view, context = _point(graph, point, network.encoding, compact=compact)
    b = network.uniform_fraction
    first, second = graph.columns(u)
    uniform = first < b
    first = graph.where(uniform, first * (1 / b), (first - b) * (1 / (1 - b)))
    start = [graph.clip(x, 0.0, 1.0) for x in (first, second)]
    z = flow_sample(graph, start, context, network.flow, uniform)
    toward = cap_to_direction(graph.concat(z), view)
    graph.output("toward", graph.where(view.outside, toward, view.axis))
    density = flow_density(graph, z, context, network.flow)
    pdf = graph.where(view.outside, _pdf(network, density, view), 0.0)
    graph.output("pdf_solid_angle", graph.flatten(pdf))
    return graph.to_bytes()


def sampler_pdf(network: Sampler, *, compact: bool = False) -> bytes:
    """point, toward [N, 3] -> pdf_solid_angle [N]."""
    graph = Graph("sampler_pdf")
    point, toward = graph.input("point", 3), graph.input("toward", 3)
    view, context = _point(graph, point, network.encoding, compact=compact)
    z, inside = direction_to_cap(toward, view)
    density = flow_density(graph, graph.columns(z), context, network.flow)
    pdf = graph.where(view.outside & inside, _pdf(network, density, view), 0.0)
    graph.output("pdf_solid_angle", graph.flatten(pdf))
    return graph.to_bytes()


def fast_map(network: FastMap, *, compact: bool = False) -> bytes:
    """point [N, 3] -> radiance_map [N, 16, 16, 3] in W/(m² sr)."""
    graph = Graph("fast_map")
    point = graph.input("point", 3)
    view, context = _point(graph, point, network.encoding, compact=compact)
    gain = _map_gain(graph, network, point, view)
    if network.one_hot:
        wide = graph.gather_columns(gain, np.arange(3).repeat(CELLS).tolist())
        cells = _channel_by_channel(graph, context, network) * wide
    else:
        cells = _tinted(graph, context, network, gain)
    graph.output("radiance_map", graph.channels_last(graph.reshape(cells, 3, SIZE, SIZE)))
    return graph.to_bytes()


def _map_gain(graph: Graph, network: FastMap, point: Value, view: Cap[Value]) -> Value:
    """The gain of each channel times its scale, see `FastMap`: [N, 3]."""
    features = harmonics(graph, view.axis, network.harmonics.degree)
    share = log_distance(point, network.encoding.sphere, network.encoding.r_max)
    knots = network.tilt.cpu().double().numpy()
    tilts = [
        graph.linear(features.value, weight @ features.matrix, weight @ features.offset) * hat
        for weight, hat in zip(knots, hats(share, network.encoding.r_max), strict=True)
    ]
    scale = (network.scale * network.channels).cpu().numpy()
    tilt = graph.clip(sum(tilts[1:], tilts[0]), -MOST_GAIN, MOST_GAIN)
    return graph.exp(tilt) * scale


def _tinted(graph: Graph, context: Features, network: FastMap, gain: Value) -> Value:
    """Brightness times tint times gain of each channel and cell, see `FastMap.value`."""
    brightness, (y,) = _cells(graph, context, network, network.ceiling)
    raw = graph.split(graph.exp(graph.clip(y, -MOST_TINT, MOST_TINT)), 3 * [BLOCKS])
    red, green, blue = (tint * float(w) for tint, w in zip(raw, network.share, strict=True))
    total = red + green + blue
    tint = graph.concat([t * g / total for t, g in zip(raw, graph.columns(gain), strict=True)])
    # Wide along a row, which is spread over the rows of its blocks
    wide = graph.gather_columns(tint, np.arange(3 * BLOCKS).repeat(SIDE).tolist())
    rows = graph.reshape(brightness, 1, SIDE, SIDE, SIZE)
    return rows * graph.reshape(wide, 3, SIDE, 1, SIZE)


def _cells(
    graph: Graph, features: Features, network: FastMap, ceiling: Tensor
) -> tuple[Value, list[Value]]:
    """Brightness of every cell, no more than its ceiling, and the outputs of tints if any."""
    raw = mlp(graph, [features], network.network)
    x, *y, s = graph.split(raw, [n for n in (CELLS, network.tints, 1) if n])
    level = s + mlp(graph, [features], nn.Sequential(network.level))
    level = graph.clip(level, LEAST_LOG, MAX_LOG) + math.log(CELLS)
    least, most = math.exp(LEAST_LOG), math.exp(float(ceiling))
    return graph.clip(graph.softmax(x) * graph.exp(level), least, most), y


def _channel_by_channel(graph: Graph, context: Features, network: FastMap) -> Value:
    """Columns [channel, cell] without gain of a network that takes the channel as an input."""
    channels = network.channels.cpu().numpy()
    maps = []
    for channel in np.flatnonzero(channels) if channels.any() else [0]:
        one_hot = Features(context.value, *_with_constant(context, np.eye(3)[channel]))
        maps.append(_cells(graph, one_hot, network, network.ceiling[channel])[0])
    present = np.cumsum(channels > 0).clip(1) - 1
    return graph.concat([maps[int(k)] for k in present])


def _with_constant(features: Features, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Affine map of features followed by constants."""
    matrix = np.pad(features.matrix, ((0, len(values)), (0, 0)))
    return matrix, np.concatenate([features.offset, values])


def _ray(graph: Graph) -> tuple[Value, Value, Value]:
    """The inputs of a surface network: position, normal, outgoing."""
    position, normal, outgoing = (
        graph.input(name, 3) for name in ("position", "normal", "outgoing")
    )
    return position, normal, outgoing


def _tilt(graph: Graph, student: Student, outgoing: Value) -> Value:
    """The part of the gain that changes with direction: [N, 3]."""
    features = harmonics(graph, outgoing, student.harmonics.degree)
    weight = student.tilt.cpu().double().numpy()
    return graph.exp(
        graph.linear(features.value, weight @ features.matrix, weight @ features.offset)
    )


def _surface(
    graph: Graph,
    network: SurfaceNetwork,
    position: Value,
    normal: Value,
    outgoing: Value,
    *,
    compact: bool,
) -> Value:
    """The outputs of a surface network before its last activation: [N, 3]."""
    offset = (position - network.centre.double().numpy()) * (0.5 / network.radius)
    degree = network.harmonics.degree
    place = lifted(offset, normal, network.lift) + 0.5
    parts = [grid(graph, place, network.grid, compact=compact)]
    for kind, table in network.anchors.items():
        assert isinstance(table, GridEncoding)
        ray = outgoing
        if kind == "refracted":
            ray = refracted(normal, outgoing, network.index)
        anchor = offset - graph.sum(offset * ray) * ray
        parts.append(grid(graph, anchor + 0.5, table, compact=compact))
    parts += [harmonics(graph, direction, degree) for direction in (outgoing, normal)]
    return mlp(graph, [join(graph, parts)], network.network)


def _point(
    graph: Graph, point: Value, encoding: PointEncoding, *, compact: bool
) -> tuple[Cap[Value], Features]:
    """The cap seen from a point, and the point's encoding (`PointEncoding`)."""
    view = cap(point, encoding.sphere)
    place, angle = encode_point(point, encoding.sphere, encoding.r_max)
    parts = [grid(graph, place, encoding.grid, compact=compact), one_blob(graph, angle, ANGLE_BINS)]
    return view, join(graph, parts)


def _pdf(network: Sampler, density: Value, view: Cap[Value]) -> Value:
    """Density per solid angle of the defensive mixture: [N, 1]."""
    b = network.uniform_fraction
    return (density * (1 - b) + b) / view.solid_angle


@dataclass(frozen=True)
class Exported:
    """Where a network of the bundle comes from.

    Arguments:
        trained: name of the network in the run directory.
        module: class of that network.
        graph: makes ONNX bytes of it; takes `compact`.
        method: of the module, which the graph must equal.
        uniform_fraction: weight of the uniform cap, for the sampler.
    """

    trained: str
    module: Callable[[Description, Preset], Any]
    graph: Callable[..., bytes]
    method: str = "forward"
    uniform_fraction: float | None = None


EXPORTED = {
    "appearance": Exported("student", Student, appearance),
    "transparency": Exported("transparency", Transparency, transparency),
    "sampler": Exported("sampler", Sampler, sampler, uniform_fraction=UNIFORM_FRACTION),
    "sampler_pdf": Exported("sampler", Sampler, sampler_pdf, "pdf_solid_angle"),
    "fast_map": Exported("fast_map", FastMap, fast_map),
}
