"""A colour for each direction, looked up on the device."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.sampling.far_field import HORIZONTAL, VERTICAL


class DirectionTable:
    """Colours on the regular grid of `far_field`, linear between its nodes.

    Arguments:
        values: [HORIZONTAL, VERTICAL, 3].
    """

    def __init__(self, values: np.ndarray) -> None:
        padded = np.pad(values, [(0, 0), (0, 0), (0, 1)])
        self._table = device_array(mi.Float, padded)

    def at(self, direction: mi.Vector3f, active: mi.Bool) -> mi.Color3f:
        """The colour in directions of the table's frame; its nadir is -Z."""
        sine = dr.sqrt(dr.square(direction.x) + dr.square(direction.y))
        turn = dr.atan2(direction.y, direction.x) * dr.inv_two_pi
        return self.at_angles(dr.atan2(sine, -direction.z), turn, active)

    def at_angles(self, vertical: mi.Float, turn: mi.Float, active: mi.Bool) -> mi.Color3f:
        """The colour at angles.

        Arguments:
            vertical: From -Z, in radians.
            turn: From +X by +Y, in whole turns.
        """
        v = vertical * ((VERTICAL - 1) / dr.pi)
        h = (turn - dr.floor(turn)) * (HORIZONTAL - 1)
        row = dr.clip(dr.floor(v), 0, VERTICAL - 2)
        plane = dr.clip(dr.floor(h), 0, HORIZONTAL - 2)
        first = mi.UInt32(plane) * VERTICAL + mi.UInt32(row)
        low, high = (
            dr.lerp(self._node(first + k, active), self._node(first + k + 1, active), v - row)
            for k in (0, VERTICAL)
        )
        return dr.lerp(low, high, h - plane)

    def _node(self, index: mi.UInt32, active: mi.Bool) -> mi.Color3f:
        value = dr.gather(mi.Vector4f, self._table, index, active)
        return mi.Color3f(value.x, value.y, value.z)
