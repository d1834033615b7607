"""Bodies with finishes, as shapes on which a path may have a vertex."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from purelight_mitsuba.device_array import device_array
from purelight_mitsuba.lamps.bodies import Bodies
from purelight_mitsuba.lamps.finish_bsdf import FinishBSDF, ScatterBSDF
from purelight_mitsuba.lamps.finishes import Finishes


class FinishedBodies:
    """What reflects on bodies, in which rays meet them, and what scatters there.

    Arguments:
        sides: Finishes of front and back, for each triangle of the bodies.
    """

    def __init__(self, bodies: Bodies, finishes: Finishes, sides: np.ndarray) -> None:
        own = device_array(mi.UInt32, sides)
        self.mesh = bodies.mesh(FinishBSDF(finishes, own))
        self._scattering = bodies.mesh(ScatterBSDF(finishes, own), copies=2)
        self._shapes = mi.ShapePtr(self.mesh), mi.ShapePtr(self._scattering)
        self._count = dr.opaque(mi.UInt32, bodies.count)

    def note(
        self, found: mi.PreliminaryIntersection3f, triangle: mi.UInt32, ahead: mi.Bool,
        back: mi.Bool, active: mi.Bool,
    ) -> None:  # fmt: skip
        """Notes a triangle where a path reflects, or where it is scattered."""
        index = triangle + dr.select(back, self._count, 0)
        shape = dr.select(ahead | back, self._shapes[1], self._shapes[0])
        found.prim_index = dr.select(active, index, found.prim_index)
        found.shape = dr.select(active, shape, found.shape)

    def has(self, found: mi.PreliminaryIntersection3f) -> tuple[mi.Bool, mi.Bool]:
        """Whether a vertex is on them, and whether it is scattered there."""
        reflecting, scattering = (found.is_valid() & (found.shape == s) for s in self._shapes)
        return reflecting | scattering, scattering
