"""What a segment's next lamp lets through of the light behind it."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.exits import Hit
from purelight_mitsuba.lamps.table import Lamps
from purelight_mitsuba.transport.queries import Answer, ExitRay, Queries
from purelight_mitsuba.transport.segment import Meeting, Segment


class Transmittance:
    """The transmittance of lamps, asked from where it is that of the segment.

    A network's is that of the whole lamp ahead of who asks. If the segment ends at something
    between the lamp's parts, so that some are beyond, it is asked from there, back along the
    segment; unless that has some behind it too, and then neither end knows the part between.
    """

    def __init__(self, lamps: Lamps, queries: Queries) -> None:
        self._lamps, self._queries = lamps, queries

    def __call__(self, on: Segment, start: mi.Float, met: Meeting, active: mi.Bool) -> Answer:
        """The transmittance for a segment that has been walked up to `start`."""
        end = dr.fma(on.direction, on.length, on.origin)
        between = active & (on.length < dr.largest(mi.Float)) & (met.place.radii(end) < 1)
        hit, at, along = dr.if_stmt(
            (on, start, met.hit, met.point, end),
            between,
            self._from_end,
            lambda on, start, hit, p, end: (hit, p, on.direction),
        )
        return self._queries.transmittance(met.place, ExitRay.of(met.place, hit, at, along), active)

    def _from_end(
        self, on: Segment, start: mi.Float, hit: Hit, p: mi.Point3f, end: mi.Point3f
    ) -> tuple[Hit, mi.Point3f, mi.Vector3f]:
        """Where a ray back from the end meets the lamp and its direction, if it is to be asked."""
        begin = dr.fma(on.direction, start, on.origin)
        beyond = self._meets(end, on.direction, hit.lamp)
        behind = self._meets(begin, -on.direction, hit.lamp)
        back = self._lamps.first(mi.Ray3f(end, -on.direction), hit.lamp, beyond & ~behind)
        turned = beyond & ~behind & back.valid
        at = dr.fma(-on.direction, back.t, end)
        along = dr.select(turned, -on.direction, on.direction)
        return dr.select(turned, back, hit), dr.select(turned, at, p), along

    def _meets(self, origin: mi.Point3f, direction: mi.Vector3f, lamp: mi.UInt32) -> mi.Bool:
        """Whether a ray meets a lamp, as the first one where none overlap."""
        return self._lamps.first(mi.Ray3f(origin, direction), lamp, mi.Bool(True)).valid
