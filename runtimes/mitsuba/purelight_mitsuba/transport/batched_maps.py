"""Draws from radiance maps that ONNX Runtime evaluates, for vertices that waited in a queue."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.lamps.luminaire import Luminaire
from purelight_mitsuba.sampling.radiance_map import SIDE, Drawn, draw, lit
from purelight_mitsuba.translate.operators import Tensor, row

# Multiply-adds a map. ONNX Runtime multiplies matrices three times as fast, but moves 768 numbers
# a map out and in: measured, 3.8 + 0.016 and 0.2 + 0.047 microseconds per thousand.
LARGEST_COMPILED = 110_000
ROWS = 1 << 14  # Of one batch, 3 kB each.


def compiled(luminaire: Luminaire) -> bool:
    """Whether Dr.Jit draws from a luminaire's map sooner than ONNX Runtime."""
    if dr.backend_v(mi.Float) == dr.JitBackend.CUDA:
        return True
    return luminaire.cost("fast_map") <= LARGEST_COMPILED


def draw_batched(luminaire: Luminaire, point: mi.Point3f, u: mi.Point2f, active: mi.Bool) -> Drawn:
    """Draws from the map of each active lane as `radiance_map.draw` does; not for symbolic loops.

    Arguments:
        point: In the luminaire frame.
        u: Uniform numbers.
    """
    lanes = dr.compress(active)
    result = dr.zeros(Drawn, dr.width(active))
    dr.eval(point, u)
    for start in range(0, len(lanes), ROWS):
        count = min(ROWS, len(lanes) - start)
        part = dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, start)
        lane = dr.gather(mi.UInt32, lanes, part)
        rows = np.array(dr.gather(mi.Point3f, point, lane)).T
        maps = luminaire.session("fast_map")({"point": rows})["radiance_map"]
        cells = lit(_columns(maps), luminaire.flux)
        dr.scatter(result, draw(cells, dr.gather(mi.Point2f, u, lane)), lane)
        dr.eval(result)
    return result


def _columns(maps: np.ndarray) -> Tensor:
    """Maps [N, SIDE, SIDE, 3] as scalars [SIDE, SIDE, 3]."""
    values, size = mi.Float(maps.ravel()), SIDE * SIDE * 3
    first = dr.arange(mi.UInt32, len(maps)) * size
    cells = row([dr.gather(mi.Float, values, first + k) for k in range(size)])
    return cells.reshape(SIDE, SIDE, 3)
