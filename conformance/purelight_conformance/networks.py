"""The networks of the suite's lamps: a few layers each, in ONNX's own text.

Eqs. 1 to 6 of spec/measures.md stand here once more, independent of `purelight_format.measures` on
purpose: a mistake in either shows where the suite compares networks with the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from purelight_format.errors import PureLightError
from purelight_format.measures import BoundingSphere
from purelight_format.networks.profile import IR_VERSION, OPSET, ROWS
from purelight_format.networks.vectors import SIGNATURES, Shapes

BINS = 8  # Of the sampler's density, along either side of the cap's square.
UNIFORM_FRACTION = 0.1
GRID = 16  # Entries of the table that the appearance looks up.
HIDDEN = 32
CELLS = 256

Constants = dict[str, np.ndarray]


@dataclass(frozen=True)
class Emission:
    """What the networks of a lamp are made from.

    Arguments:
        sphere: the bounding sphere.
        scale: [3] radiance that counts as medium, W/(m² sr); zero in absent channels.
        r_max: farthest distance of which the networks know, in radii.
        seed: of the weights.
    """

    sphere: BoundingSphere
    scale: tuple[float, float, float]
    r_max: float = 15.0
    seed: int = 1


# Pieces. Every computed value has the rows as its first axis; constants are named in capitals.

LOCAL = """
  away = Sub (position, CENTRE)
  local = Mul (away, PER_RADIUS)
  surface = Concat <axis = 1> (local, normal, outgoing)
"""

# A table of 4 columns, looked up by the height in the lamp and interpolated.
LOOKUP = """
  z0 = Slice (local, TWO, THREE, ONE)
  z1 = Add (z0, UNIT)
  z2 = Mul (z1, HALF_GRID)
  z = Clip (z2, LOW, HIGH)
  below = Floor (z)
  index = Cast <to = 7> (below)
  above = Add (index, NEXT)
  share = Sub (z, below)
  rest = Sub (UNIT, share)
  g0 = Gather (TABLE, index)
  g1 = Gather (TABLE, above)
  f0 = Squeeze (g0, ONE)
  f1 = Squeeze (g1, ONE)
  h0 = Mul (f0, rest)
  h1 = Mul (f1, share)
  height = Add (h0, h1)
"""

# Eq. 4 and the axis, seen from a point.
CAP = """
  o0 = Sub (CENTRE, point)
  o1 = Mul (o0, PER_RADIUS)
  offset = Clip (o1, NEAREST, FARTHEST)
  squares = Mul (offset, offset)
  square = ReduceSum <keepdims = 1> (squares, ONE)
  distance = Sqrt (square)
  apart = Greater (distance, ZERO)
  safe = Where (apart, distance, UNIT)
  a0 = Div (offset, safe)
  axis = Where (apart, a0, UP)
  d1 = Max (distance, UNIT)
  sine = Reciprocal (d1)
  s2 = Mul (sine, sine)
  c2 = Sub (UNIT, s2)
  cosine = Sqrt (c2)
  c1 = Add (UNIT, cosine)
  spread = Div (s2, c1)
  outside = Greater (distance, RIM)
  ratio = Min (d1, FARTHEST_RATIO)
  l0 = Log (ratio)
  l = Mul (l0, PER_LOG)
  seen = Concat <axis = 1> (axis, l)
  e0 = Gemm <transB = 1> (seen, W_IN, B_IN)
  hidden = Relu (e0)
"""

# Eq. 1 about the axis.
FRAME = """
  x, y, z = Split <axis = 1> (axis, COLUMNS)
  xx0 = Mul (x, x)
  yy0 = Mul (y, y)
  rho = Add (xx0, yy0)
  under = Less (z, ZERO)
  close = Less (rho, TINY)
  pole = And (under, close)
  thick = Max (rho, TINY)
  z_size = Abs (z)
  z_more = Add (UNIT, z_size)
  k0 = Div (z_more, thick)
  k1 = Reciprocal (z_more)
  k = Where (under, k0, k1)
  kx = Mul (k, x)
  ky = Mul (k, y)
  xx1 = Mul (kx, x)
  xy1 = Mul (kx, y)
  yy1 = Mul (ky, y)
  xx = Where (pole, TWICE, xx1)
  xy2 = Where (pole, ZERO, xy1)
  yy = Where (pole, ZERO, yy1)
  xy = Neg (xy2)
  t0 = Sub (UNIT, xx)
  t2 = Neg (x)
  b1 = Sub (UNIT, yy)
  b2 = Neg (y)
  tangent = Concat <axis = 1> (t0, xy, t2)
  bitangent = Concat <axis = 1> (xy, b1, b2)
"""

# Eq. 2 and 5: the square v0, v1 becomes a direction of the cap.
TO_DIRECTION = """
  p0 = Mul (v0, TWICE)
  p1 = Mul (v1, TWICE)
  a = Sub (p0, UNIT)
  b = Sub (p1, UNIT)
  a_size = Abs (a)
  b_size = Abs (b)
  wide = Greater (a_size, b_size)
  r = Where (wide, a, b)
  minor = Where (wide, b, a)
  middle = Equal (r, ZERO)
  r_safe = Where (middle, UNIT, r)
  tilt = Div (minor, r_safe)
  phi = Mul (tilt, QUARTER_PI)
  cos = Cos (phi)
  sin = Sin (phi)
  along = Mul (r, cos)
  across = Mul (r, sin)
  dx = Where (wide, along, across)
  dy = Where (wide, across, along)
  dx2 = Mul (dx, dx)
  dy2 = Mul (dy, dy)
  dd = Add (dx2, dy2)
  m = Mul (dd, spread)
  m2 = Sub (TWICE, m)
  q2 = Mul (spread, m2)
  q = Sqrt (q2)
  qx = Mul (q, dx)
  qy = Mul (q, dy)
  m1 = Sub (UNIT, m)
  w0 = Mul (axis, m1)
  w1 = Mul (tangent, qx)
  w2 = Mul (bitangent, qy)
  w3 = Add (w1, w2)
  w = Add (w0, w3)
  toward = Where (outside, w, axis)
"""

# Eq. 3 and 6: a direction becomes v0, v1 of the square, and whether it is inside.
TO_SQUARE = """
  delta = Sub (toward, axis)
  delta2 = Mul (delta, delta)
  m0 = ReduceSum <keepdims = 1> (delta2, ONE)
  m = Mul (m0, HALF)
  m2 = Sub (TWICE, m)
  q2 = Mul (spread, m2)
  q3 = Max (q2, LEAST_Q)
  q = Sqrt (q3)
  dt = Mul (delta, tangent)
  db = Mul (delta, bitangent)
  dx0 = ReduceSum <keepdims = 1> (dt, ONE)
  dy0 = ReduceSum <keepdims = 1> (db, ONE)
  dx1 = Div (dx0, q)
  dy1 = Div (dy0, q)
  dx2 = Mul (dx1, dx1)
  dy2 = Mul (dy1, dy1)
  reach = Add (dx2, dy2)
  within = LessOrEqual (reach, UNIT)
  ahead = LessOrEqual (m, AHEAD)
  i0 = And (within, ahead)
  inside = And (i0, outside)
  reach1 = Max (reach, UNIT)
  reach2 = Sqrt (reach1)
  dx = Div (dx1, reach2)
  dy = Div (dy1, reach2)
  x_size = Abs (dx)
  y_size = Abs (dy)
  wide = Greater (x_size, y_size)
  major = Where (wide, dx, dy)
  minor = Where (wide, dy, dx)
  sign = Sign (major)
  x2 = Mul (dx, dx)
  y2 = Mul (dy, dy)
  r2 = Add (x2, y2)
  r1 = Sqrt (r2)
  r = Mul (r1, sign)
  middle = Equal (major, ZERO)
  m_safe = Where (middle, UNIT, major)
  slope = Div (minor, m_safe)
  angle = Atan (slope)
  turn = Mul (r, angle)
  t = Mul (turn, PER_QUARTER_PI)
  a = Where (wide, r, t)
  b = Where (wide, t, r)
  a_half = Mul (a, HALF)
  b_half = Mul (b, HALF)
  a_moved = Add (a_half, HALF)
  b_moved = Add (b_half, HALF)
  v0 = Clip (a_moved, LOW, TOP)
  v1 = Clip (b_moved, LOW, TOP)
"""

# The density of one side of the square: a softmax, mixed with the uniform density.
DENSITY = """
  logit{k} = Gemm <transB = 1> (hidden, W{k}, B{k})
  soft{k} = Softmax <axis = 1> (logit{k})
  part{k} = Mul (soft{k}, LEARNED)
  bin{k} = Add (part{k}, EVEN)
"""

# Draws v{k} from that density by u{k}, and its value there.
DRAW = """
  sum{k} = CumSum <exclusive = 1> (bin{k}, AXIS)
  reached{k} = GreaterOrEqual (u{k}, sum{k})
  count{k} = Cast <to = 1> (reached{k})
  number{k} = ReduceSum <keepdims = 1> (count{k}, ONE)
  cell{k} = Sub (number{k}, UNIT)
  place{k} = Cast <to = 7> (cell{k})
  mass{k} = GatherElements <axis = 1> (bin{k}, place{k})
  start{k} = GatherElements <axis = 1> (sum{k}, place{k})
  over{k} = Sub (u{k}, start{k})
  inner{k} = Div (over{k}, mass{k})
  inner1{k} = Min (inner{k}, UNIT)
  at{k} = Add (cell{k}, inner1{k})
  v{k} = Mul (at{k}, PER_BIN)
"""

# Its value at v{k}.
FIND = """
  at{k} = Mul (v{k}, BINS)
  cell{k} = Floor (at{k})
  cell1{k} = Min (cell{k}, LAST)
  place{k} = Cast <to = 7> (cell1{k})
  mass{k} = GatherElements <axis = 1> (bin{k}, place{k})
"""

# The density on the square becomes one per solid angle.
PDF = """
  both = Mul (mass0, mass1)
  even = Mul (both, PER_CAP)
  per_sr = Div (even, spread)
  served = Where ({where}, per_sr, ZERO)
  pdf_solid_angle = Squeeze (served, ONE)
"""

BOTH_DENSITIES = DENSITY.format(k=0) + DENSITY.format(k=1)

BODIES = {
    "appearance": LOCAL + LOOKUP + """
  features = Concat <axis = 1> (surface, height)
  h2 = Gemm <transB = 1> (features, W0, B0)
  h3 = Relu (h2)
  h4 = Gemm <transB = 1> (h3, W1, B1)
  h5 = Relu (h4)
  h6 = Gemm <transB = 1> (h5, W2, B2)
  level = Exp (h6)
  radiance = Mul (level, SCALE)
""",
    "transparency": LOCAL + """
  h2 = Gemm <transB = 1> (surface, W0, B0)
  h3 = Relu (h2)
  h4 = Gemm <transB = 1> (h3, W1, B1)
  transmittance = Sigmoid (h4)
""",
    "sampler": CAP + FRAME + BOTH_DENSITIES + """
  u0, u1 = Split <axis = 1> (u, PAIR)
""" + DRAW.format(k=0) + DRAW.format(k=1) + TO_DIRECTION + PDF.format(where="outside"),
    "sampler_pdf": CAP + FRAME + BOTH_DENSITIES + TO_SQUARE
    + FIND.format(k=0) + FIND.format(k=1) + PDF.format(where="inside"),
    "fast_map": CAP + """
  flat = Gemm <transB = 1> (hidden, W0, B0)
  level = Exp (flat)
  cells = Reshape (level, MAP)
  radiance_map = Mul (cells, SCALE)
""",
}  # fmt: skip

# Lamps that show one mistake alone: they depend on the axes but not on the channel, or the reverse.
COMPASS = {
    "appearance": LOCAL + """
  radiance = Gemm <transB = 1> (surface, W0, B0)
""",
    "fast_map": CAP + """
  still = Mul (hidden, ZERO)
  flat = Gemm <transB = 1> (still, W0, B0)
  radiance_map = Reshape (flat, MAP)
""",
}  # fmt: skip


def wild(emission: Emission) -> dict[str, bytes]:
    """All five networks, with random weights."""
    return {
        name: _model(name, body, _constants(emission) | _weights(name, emission))
        for name, body in BODIES.items()
    }


def compass(emission: Emission) -> dict[str, bytes]:
    """Grey light that depends on every component of every input, and on the cell of the map.

    The map is brightest at one corner and falls off from it the faster in u, so that wherever a
    turned or mirrored one is taken for it, light comes from elsewhere.
    """
    slopes = np.array([1, 2, 4, 0.5, -1, 1.5, 3, -2, 0.25])
    v, u = np.indices((16, 16)) / 16
    cells = np.arange(1.0, CELLS + 1).reshape(16, 16) / 64 + 250 * (1 - v) ** 3 * (1 - u) ** 6
    weights = {
        "appearance": {"W0": np.tile(slopes, (3, 1)), "B0": np.full(3, 20.0)},
        "fast_map": _plain_map(np.repeat(cells, 3)),
    }
    return _plain(emission, weights)


def paint(emission: Emission) -> dict[str, bytes]:
    """Light of one colour, whatever the inputs."""
    weights = {
        "appearance": {"W0": np.zeros((3, 9)), "B0": np.array([3.0, 2.0, 1.0])},
        "fast_map": _plain_map(np.tile([3.0, 2.0, 1.0], CELLS)),
    }
    return _plain(emission, weights)


def _plain(emission: Emission, weights: Mapping[str, Constants]) -> dict[str, bytes]:
    return {
        name: _model(name, body, _constants(emission) | weights[name])
        for name, body in COMPASS.items()
    }


def _plain_map(cells: np.ndarray) -> Constants:
    still = {"W_IN": np.zeros((4, 4)), "B_IN": np.zeros(4)}
    return still | {"W0": np.zeros((len(cells), 4)), "B0": cells}


def _constants(emission: Emission) -> Constants:
    """What the pieces name in capitals: numbers are [1, 1], bounds of Clip have no axis."""
    sphere = emission.sphere
    numbers = {
        "ZERO": 0, "UNIT": 1, "TWICE": 2, "HALF": 0.5, "TINY": 1e-20, "LEAST_Q": 1e-30,
        "AHEAD": 1.5, "RIM": 1 + 1e-6, "PER_RADIUS": 1 / sphere.radius, "HALF_GRID": GRID / 2,
        "QUARTER_PI": np.pi / 4, "PER_QUARTER_PI": 4 / np.pi, "BINS": BINS, "LAST": BINS - 1,
        "PER_BIN": 1 / BINS, "LEARNED": 1 - UNIFORM_FRACTION, "EVEN": UNIFORM_FRACTION / BINS,
        "PER_CAP": BINS**2 / (2 * np.pi), "FARTHEST_RATIO": emission.r_max,
        "PER_LOG": 1 / np.log(emission.r_max),
    }  # fmt: skip
    bounds = {
        "LOW": 0, "HIGH": GRID - 1e-3, "TOP": 1, "NEAREST": -1e15, "FARTHEST": 1e15,
    }  # fmt: skip
    whole = {
        "ONE": [1], "TWO": [2], "THREE": [3], "NEXT": [[1]], "AXIS": 1, "COLUMNS": [1, 1, 1],
        "PAIR": [1, 1], "MAP": [-1, 16, 16, 3],
    }  # fmt: skip
    return {
        **{name: np.full((1, 1), float(value)) for name, value in numbers.items()},
        **{name: np.array(float(value)) for name, value in bounds.items()},
        **{name: np.array(value, np.int64) for name, value in whole.items()},
        "CENTRE": np.array(sphere.center),
        "UP": np.array([0.0, 0.0, 1.0]),
        "SCALE": np.array(emission.scale),
    }


LAYERS = {
    "appearance": {"0": (HIDDEN, 13), "1": (HIDDEN, HIDDEN), "2": (3, HIDDEN)},
    "transparency": {"0": (16, 9), "1": (3, 16)},
    "sampler": {"_IN": (16, 4), "0": (BINS, 16), "1": (BINS, 16)},
    "fast_map": {"_IN": (8, 4), "0": (CELLS * 3, 8)},
}


def _weights(network: str, emission: Emission) -> Constants:
    """Random layers, and the table; the sampler and its density have the same."""
    family = network.removesuffix("_pdf")
    rng = np.random.default_rng([emission.seed, len(family)])
    constants = {"TABLE": rng.standard_normal((GRID + 1, 4))}
    for name, (width, size) in LAYERS[family].items():
        constants[f"W{name}"] = rng.standard_normal((width, size)) * np.sqrt(2 / size)
        constants[f"B{name}"] = 0.3 * rng.standard_normal(width)
    return constants


def _model(network: str, body: str, constants: Mapping[str, np.ndarray]) -> bytes:
    """Serialises the nodes that the outputs need, and the constants that these need."""
    try:
        from onnx import helper, numpy_helper, parser
    except ImportError as error:
        raise PureLightError('the suite needs onnx: pip install "purelight[onnx]"') from error

    inputs, outputs = map(_declared, SIGNATURES[network])
    graph = parser.parse_graph(f"{network} ({inputs}) => ({outputs}) {{{body}}}")
    nodes = _needed(graph)
    used = {name for node in nodes for name in node.input}
    tensors = [
        numpy_helper.from_array(array if array.dtype == np.int64 else array.astype("<f4"), name)
        for name, array in sorted(constants.items())
        if name in used
    ]
    plain = helper.make_graph(nodes, network, graph.input, graph.output, tensors)
    opset = [helper.make_opsetid("", OPSET)]
    model = helper.make_model(plain, opset_imports=opset, ir_version=IR_VERSION)
    return model.SerializeToString(deterministic=True)


def _declared(shapes: Shapes) -> str:
    sizes = {name: ",".join([ROWS, *map(str, shape)]) for name, shape in shapes.items()}
    return ", ".join(f"float[{size}] {name}" for name, size in sizes.items())


def _needed(graph: Any) -> list[Any]:
    wanted = {value.name for value in graph.output}
    kept = []
    for node in reversed(graph.node):
        if wanted.intersection(node.output):
            wanted.update(node.input)
            kept.append(node)
    return kept[::-1]
