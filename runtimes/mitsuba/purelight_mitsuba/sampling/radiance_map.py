"""A lamp's radiance map, seen from a point: drawing a direction from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE
from purelight_mitsuba.translate.operators import Tensor, row

SIDE = 16
BELOW_ONE = 1 - 2**-20  # The largest such that 15 + it is below 16 in single precision.


@dataclass
class Drawn:
    """A point drawn from a map, per lane.

    Arguments:
        square: Where it is in the cap's square.
        weight: Radiance of its cell over the density of the point in the square; zero where the
            map is black.
        spoilt: 1 where a cell was infinite or no number.
    """

    square: mi.Point2f
    weight: mi.Color3f
    spoilt: mi.UInt32


def lit(cells: Tensor, flux: np.ndarray) -> Tensor:
    """Blackens channels without flux, so that they are never computed.

    Arguments:
        cells: Radiance [SIDE, SIDE, 3], as scalars.
        flux: Of the lamp, [3].
    """
    shines = np.broadcast_to(flux > 0, cells.shape).ravel()
    values = zip(cells.ravel(), shines, strict=True)
    return row([value if own else mi.Float(0) for value, own in values]).reshape(cells.shape)


def draw(cells: Tensor, u: mi.Point2f) -> Drawn:
    """Draws a cell in proportion to its luminance, and a point evenly inside it.

    A row is drawn first, then a cell of it (`spec/measures.md`, Eq. 13). What is negative, infinite
    or no number counts as black.

    Arguments:
        cells: Radiance [SIDE, SIDE, 3], as scalars.
        u: Uniform numbers.
    """
    power, spoilt = np.empty((SIDE, SIDE), object), mi.Bool(False)
    for index in np.ndindex(power.shape):
        luminance = _luminance(cells[index])
        spoilt |= ~dr.isfinite(luminance)
        power[index] = dr.select((luminance > 0) & (luminance < dr.inf), luminance, 0)
    total, sums = _sum(list(power.ravel())), [_sum(list(line)) for line in power]
    v, chosen = _choose(sums, u.y, [[*power[k], *cells[k].ravel()] for k in range(SIDE)])
    line, colours = chosen[:SIDE], chosen[SIDE:]
    x, (own, *colour) = _choose(line, u.x, [[line[k], *colours[3 * k :][:3]] for k in range(SIDE)])
    weight = dr.maximum(mi.Color3f(*colour), 0) * (total / (own * SIDE * SIDE))
    return Drawn(mi.Point2f(x, v) / SIDE, dr.select(own > 0, weight, 0), mi.UInt32(spoilt))


def _luminance(cell: Tensor) -> mi.Float:
    red, green, blue = LUMINANCE.tolist()
    return dr.fma(cell[0], red, dr.fma(cell[1], green, cell[2] * blue))


def _sum(values: Sequence[mi.Float]) -> mi.Float:
    return sum(values[1:], values[0])


def _choose(
    weights: Sequence[mi.Float], u: mi.Float, items: Sequence[Sequence[mi.Float]]
) -> tuple[mi.Float, list[mi.Float]]:
    """Chooses one of some items in proportion to weights that are not negative.

    Returns:
        The number of the item with, after the point, what is left of u; and the item. Both are
        zero if all weights are.
    """
    target = u * _sum(weights)
    place, chosen, before = mi.Float(0), [mi.Float(0)] * len(items[0]), mi.Float(0)
    for index, (weight, item) in enumerate(zip(weights, items, strict=True)):
        taken = (weight > 0) & (target >= before)  # The last one that is taken stays.
        rest = dr.minimum((target - before) / weight, BELOW_ONE)
        place = dr.select(taken, index + rest, place)
        chosen = [dr.select(taken, new, old) for new, old in zip(item, chosen, strict=True)]
        before = before + weight
    return place, chosen
