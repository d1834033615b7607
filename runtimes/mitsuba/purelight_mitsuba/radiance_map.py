"""A lamp's radiance map, seen from a point: drawing a direction from it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_format.color import LUMINANCE


class RadianceMap:
    """The mean radiance of the cells of a grid on the cap's square.

    Arguments:
        cells: [rows, columns, 3] object array of `mi.Float`; rows run along v, columns along u.
    """

    def __init__(self, cells: np.ndarray) -> None:
        self._rows, self._columns, _ = cells.shape
        self._colours = [mi.Color3f(*cell) for cell in cells.reshape(-1, 3)]

    def sample(self, u: mi.Point2f) -> tuple[mi.Point2f, mi.Color3f]:
        """Draws a cell by its luminance, and a point of the square evenly inside it.

        Returns:
            The point, and the cell's radiance over the density of the draw on the square.
        """
        weights = mi.Color3f(*LUMINANCE.tolist())  # Those of Mitsuba differ in the fourth digit.
        power = [dr.maximum(dr.dot(weights, colour), 0) for colour in self._colours]
        total = sum(power[1:], power[0])
        target = u.x * total
        cell, before, own, colour = mi.UInt32(0), mi.Float(0), power[0], self._colours[0]
        reached = power[0]
        for index in range(1, len(power)):
            beyond = (target >= reached) & (power[index] > 0)
            cell = dr.select(beyond, mi.UInt32(index), cell)
            before = dr.select(beyond, reached, before)
            own = dr.select(beyond, power[index], own)
            colour = dr.select(beyond, self._colours[index], colour)
            reached = reached + power[index]
        rest = dr.select(own > 0, (target - before) / own, 0)
        inner = mi.Point2f(dr.clip(rest, 0, dr.one_minus_epsilon(mi.Float)), u.y)
        corner = mi.Point2f(cell % self._columns, cell // self._columns)
        size = mi.Point2f(1 / self._columns, 1 / self._rows)
        pdf = own / total * (self._rows * self._columns)
        weight = dr.select((total > 0) & (own > 0), colour / pdf, 0)
        return (corner + inner) * size, weight
