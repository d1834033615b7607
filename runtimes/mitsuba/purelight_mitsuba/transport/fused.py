"""The engine `fused`: each network is evaluated where a path needs it, inside the loop."""

from __future__ import annotations

import mitsuba as mi

from purelight_mitsuba.transport.aimed import AimedLamps, Numbers
from purelight_mitsuba.transport.engine import Engine
from purelight_mitsuba.transport.segment import Segment
from purelight_mitsuba.transport.state import Path, Vertex


class Fused(Engine):
    """Aims at lamps at once.

    Arguments:
        aimed: Aims.
    """

    def __init__(self, aimed: AimedLamps) -> None:
        self._aimed = aimed

    def none(self) -> list[Segment]:
        return self._aimed.none()

    def aim(
        self, scene: mi.Scene, path: Path, vertex: Vertex, sampler: mi.Sampler, active: mi.Bool
    ) -> list[Segment]:
        numbers = Numbers.draw(sampler)
        shot = self._aimed.aim(scene, vertex, path.throughput, numbers, active)
        path.light = path.light.spoil(shot.spoilt)
        return shot.segments
