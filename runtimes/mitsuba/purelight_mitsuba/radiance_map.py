"""A lamp's radiance map, seen from a point: drawing a direction from it."""

from __future__ import annotations

from collections.abc import Callable

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE
from purelight_mitsuba.columns import ColumnPicker
from purelight_mitsuba.fused import FusedNetwork

SIDE = 16
SKEW = 5  # Of a lattice whose cells keep 3.2 cells apart.

Look = Callable[[mi.UInt32], mi.Color3f]


class RadianceMap:
    """Looks single cells of a `fast_map` network up.

    Arguments:
        network: From point [N, 3] to radiance [N, SIDE, SIDE, 3].
    """

    def __init__(self, network: FusedNetwork) -> None:
        cells = np.arange(SIDE * SIDE)
        self._picker = ColumnPicker(network, [3 * cells + channel for channel in range(3)])

    def __call__(self, point: mi.Point3f) -> Look:
        """Returns what tells the mean radiance of cells v · SIDE + u, seen from a point."""
        pick = self._picker(point)
        return lambda cell: mi.Color3f(*pick(cell))


def lattice(shift: mi.UInt32) -> list[mi.UInt32]:
    """Returns one cell of each row and column; the `SIDE` shifts share all cells out."""
    return [row * SIDE + (shift + SKEW * row) % SIDE for row in range(SIDE)]


def draw(look: Look, u: mi.Point2f) -> tuple[mi.Point2f, mi.Color3f]:
    """Draws a point of the cap's square, the likelier the brighter, from few cells of a map.

    Of the cells of a lattice, shifted at random, one is drawn by its luminance (resampled
    importance sampling, Talbot et al. 2005), and a point evenly inside it.

    Arguments:
        look: Radiance of cells.
        u: Uniform numbers.

    Returns:
        The point, and what to weigh light from there by: cell radiance over the density of the
        draw, in the mean over draws.
    """
    shift = dr.minimum(mi.UInt32(u.x * SIDE), SIDE - 1)
    rest = u.x * SIDE - shift
    cells = lattice(shift)
    colours = [look(cell) for cell in cells]
    weights = mi.Color3f(*LUMINANCE.tolist())  # Those of Mitsuba differ in the fourth digit.
    power = [dr.maximum(dr.dot(weights, colour), 0) for colour in colours]
    total = sum(power[1:], power[0])
    target = rest * total
    cell, before, own, colour, reached = cells[0], mi.Float(0), power[0], colours[0], power[0]
    for index in range(1, SIDE):
        beyond = (target >= reached) & (power[index] > 0)
        cell = dr.select(beyond, cells[index], cell)
        before = dr.select(beyond, reached, before)
        own = dr.select(beyond, power[index], own)
        colour = dr.select(beyond, colours[index], colour)
        reached = reached + power[index]
    inner = dr.clip(
        dr.select(own > 0, (target - before) / own, 0), 0, dr.one_minus_epsilon(mi.Float)
    )
    corner = mi.Point2f(cell % SIDE, cell // SIDE)
    weight = dr.select((total > 0) & (own > 0), colour * (total / (own * SIDE)), 0)
    return (corner + mi.Point2f(inner, u.y)) / SIDE, weight
