"""A lamp's radiance map, seen from a point: drawing a direction from it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE
from purelight_mitsuba.columns import ColumnPicker
from purelight_mitsuba.fused import FusedNetwork

SIDE = 16
SKEW = 5  # Of a lattice whose cells keep 3.2 cells apart.

DEFENCE = 0.05  # Of the candidates' mean: no cell of another hue is left out.

Look = Callable[[mi.UInt32], Any]


@dataclass(frozen=True)
class View:
    """A radiance map from one point, cell by cell: number v · SIDE + u.

    Arguments:
        channels: For each channel, what tells the mean radiance of a cell.
        leading: The channel by which cells are drawn.
    """

    channels: Sequence[Look]
    leading: int

    def importance(self, cell: mi.UInt32) -> mi.Float:
        """Radiance of the leading channel alone, a third of the work."""
        return dr.maximum(self.channels[self.leading](cell), 0)

    def colour(self, cell: mi.UInt32) -> mi.Color3f:
        """Radiance of all channels."""
        return mi.Color3f(*(look(cell) for look in self.channels))


class RadianceMap:
    """Looks single cells of a `fast_map` network up.

    Arguments:
        network: From point [N, 3] to radiance [N, SIDE, SIDE, 3].
        flux: Of the lamp, by channel.
    """

    def __init__(self, network: FusedNetwork, flux: Sequence[float]) -> None:
        cells = np.arange(SIDE * SIDE)
        self._picker = ColumnPicker(network, [3 * cells + channel for channel in range(3)])
        self._leading = int(np.argmax(LUMINANCE * np.asarray(flux)))

    def __call__(self, point: mi.Point3f) -> View:
        """The map as it is seen from a point."""
        return View(self._picker(point), self._leading)


def lattice(shift: mi.UInt32) -> list[mi.UInt32]:
    """Returns one cell of each row and column; the `SIDE` shifts share all cells out."""
    return [row * SIDE + (shift + SKEW * row) % SIDE for row in range(SIDE)]


def draw(view: View, u: mi.Point2f) -> tuple[mi.Point2f, mi.Color3f]:
    """Draws a point of the cap's square, the likelier the brighter, from few cells of a map.

    Of the cells of a lattice, shifted at random, one is drawn by its importance (resampled
    importance sampling, Talbot et al. 2005), and a point evenly inside it.

    Arguments:
        u: Uniform numbers.

    Returns:
        The point, and what to weigh light from there by: cell radiance over the density of the
        draw, in the mean over draws.
    """
    shift = dr.minimum(mi.UInt32(u.x * SIDE), SIDE - 1)
    rest = u.x * SIDE - shift
    cells = lattice(shift)
    power = [view.importance(cell) for cell in cells]
    mean = sum(power[1:], power[0]) / SIDE
    floor = dr.select(mean > 0, DEFENCE * mean, 1)
    power = [own + floor for own in power]
    total = sum(power[1:], power[0])
    target = rest * total
    cell, before, own, reached = cells[0], mi.Float(0), power[0], power[0]
    for index in range(1, SIDE):
        beyond = target >= reached
        cell = dr.select(beyond, cells[index], cell)
        before = dr.select(beyond, reached, before)
        own = dr.select(beyond, power[index], own)
        reached = reached + power[index]
    inner = dr.clip((target - before) / own, 0, dr.one_minus_epsilon(mi.Float))
    corner = mi.Point2f(cell % SIDE, cell // SIDE)
    weight = view.colour(cell) * (total / (own * SIDE))
    return (corner + mi.Point2f(inner, u.y)) / SIDE, weight
