"""Frames, disk maps and caps as graph pieces; `purelight_format.measures` is their reference.

Vectors are values of shape [N, 3], single coordinates [N, 1].
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from purelight_export.graph import Graph, Value

QUARTER_PI = math.pi / 4
TINY = 1e-20
FAR = 1e15  # Radii; farther points count as this far, so that squares stay finite.


def dot(graph: Graph, a: Value, b: Value) -> Value:
    """Inner product of the rows: [N, 3], [N, 3] -> [N, 1]."""
    return graph.sum(a * b)


def frame(graph: Graph, axis: Value) -> tuple[Value, Value]:
    """Tangent and bitangent of unit axes, right-handed, singular only at -Z: [N, 3] each."""
    x, y, z = graph.columns(axis)
    below = z < 0.0
    rho = x * x + y * y
    ahead = graph.abs(z) + 1.0
    k = graph.where(below, ahead / graph.maximum(rho, TINY), 1.0 / ahead)
    pole = below & (rho < TINY)
    kx = graph.where(pole, 0.0, k * x)
    xy, yy = kx * y, graph.where(pole, 0.0, k * y * y)
    xx = graph.where(pole, 2.0, kx * x)
    return graph.concat([1.0 - xx, -xy, -x]), graph.concat([-xy, 1.0 - yy, -y])


def square_to_disk(graph: Graph, u: Value) -> tuple[Value, Value]:
    """Equal-area concentric map (Shirley and Chiu 1997): [N, 2] in [0, 1]² -> x, y."""
    a, b = graph.columns(u * 2.0 - 1.0)
    horizontal = graph.abs(a) > graph.abs(b)
    r, minor = graph.where(horizontal, a, b), graph.where(horizontal, b, a)
    phi = QUARTER_PI * minor / _not_zero(graph, r)
    along, across = r * graph.cos(phi), r * graph.sin(phi)
    return graph.where(horizontal, along, across), graph.where(horizontal, across, along)


def disk_to_square(graph: Graph, x: Value, y: Value) -> Value:
    """Inverse of `square_to_disk`: x, y in the unit disk -> [N, 2] in [0, 1]²."""
    horizontal = graph.abs(x) > graph.abs(y)
    major, minor = graph.where(horizontal, x, y), graph.where(horizontal, y, x)
    r = graph.sqrt(x * x + y * y) * graph.sign(major)
    t = r * graph.atan(minor / _not_zero(graph, major)) * (1 / QUARTER_PI)
    a, b = graph.where(horizontal, r, t), graph.where(horizontal, t, r)
    return graph.clip(graph.concat([a, b]) * 0.5 + 0.5, 0.0, 1.0)


def _not_zero(graph: Graph, x: Value) -> Value:
    return graph.where(graph.unary("Not", graph.abs(x) > 0.0), 1.0, x)


@dataclass(frozen=True)
class Cap:
    """The cap of directions in which a sphere is seen.

    Arguments:
        axis: [N, 3] unit direction to the centre, +Z at the centre itself.
        radial: [N, 3] the same, but zero at the centre.
        distance: [N, 1] from the centre in radii.
        one_minus_cos: [N, 1] of the half-angle; the solid angle over 2 pi.
        outside: [N, 1] whether the point is outside the sphere.
    """

    axis: Value
    radial: Value
    distance: Value
    one_minus_cos: Value
    outside: Value


def cap(graph: Graph, point: Value, centre: tuple[float, ...], radius: float) -> Cap:
    """Returns the cap that the sphere covers, seen from points [N, 3]."""
    offset = graph.clip((graph.constant(centre) - point) * (1.0 / radius), -FAR, FAR)
    distance = graph.sqrt(dot(graph, offset, offset))
    radial = offset / graph.maximum(distance, TINY)
    axis = graph.where(distance > 0.0, radial, np.array([0.0, 0.0, 1.0]))
    sine = 1.0 / graph.maximum(distance, 1.0)
    square = sine * sine
    one_minus_cos = square / (1.0 + graph.sqrt(1.0 - square))
    return Cap(axis, radial, distance, one_minus_cos, distance > 1.0 + 1e-6)


def cap_to_direction(graph: Graph, u: Value, cap: Cap) -> Value:
    """Equal-area map of the square [N, 2] onto the cap: unit directions [N, 3]."""
    tangent, bitangent = frame(graph, cap.axis)
    x, y = square_to_disk(graph, u)
    m = (x * x + y * y) * cap.one_minus_cos
    q = graph.sqrt(cap.one_minus_cos * (2.0 - m))
    return cap.axis * (1.0 - m) + tangent * (q * x) + bitangent * (q * y)


def direction_to_cap(graph: Graph, toward: Value, cap: Cap) -> tuple[Value, Value]:
    """Inverse of `cap_to_direction`: square coordinates [N, 2] and whether inside [N, 1]."""
    tangent, bitangent = frame(graph, cap.axis)
    delta = toward - cap.axis
    m = 0.5 * dot(graph, delta, delta)
    q = graph.sqrt(graph.maximum(cap.one_minus_cos * (2.0 - m), 1e-30))
    x, y = dot(graph, delta, tangent) / q, dot(graph, delta, bitangent) / q
    rho = x * x + y * y
    shrink = 1.0 / graph.sqrt(graph.maximum(rho, 1.0))
    ahead = m <= 1.5  # The direction opposite to the axis has x = y = 0 as well.
    return disk_to_square(graph, x * shrink, y * shrink), (rho <= 1.0) & ahead


def refracted(graph: Graph, normal: Value, outgoing: Value, index: float) -> Value:
    """Directions inside glass of light that leaves it (`surface_network.refracted`): [N, 3]."""
    tangential = (outgoing - graph.sum(outgoing * normal) * normal) * (1 / index)
    cosine = graph.sqrt(graph.relu(1.0 - graph.sum(tangential * tangential)))
    return tangential + normal * cosine
