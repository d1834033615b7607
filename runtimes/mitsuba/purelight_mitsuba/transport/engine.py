"""What the engines share, and how a room without lamps is traced."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.transport.segment import Segment
from purelight_mitsuba.transport.state import Path, Vertex

Aim = Callable[..., list[Segment]]  # Of path, vertex, sampler and active: see `Engine.aim`.
Bounce = Callable[..., Path]  # Of path, sampler and what to do for `Aim`: see `paths`.


class Engine:
    """Follows paths, and decides when their vertices aim at a lamp: `Fused`, `Queued`, or never.

    Attributes:
        lanes: How many paths it may be given at a time.
    """

    lanes = sys.maxsize

    def none(self) -> list[Segment]:
        """As many shadow rays as `aim` returns, none of them active."""
        return []

    def follow(self, scene: mi.Scene, bounce: Bounce, path: Path, sampler: mi.Sampler) -> Path:
        """Lets paths bounce to their end."""

        def body(path: Path, sampler: mi.Sampler) -> tuple[Path, mi.Sampler]:
            return bounce(path, sampler, partial(self.aim, scene)), sampler

        path, _ = dr.while_loop(
            (path, sampler), lambda path, _: path.pending(), body, label="PureLight paths"
        )
        return path

    def aim(
        self, scene: mi.Scene, path: Path, vertex: Vertex, sampler: mi.Sampler, active: mi.Bool
    ) -> list[Segment]:
        """Shadow rays from a path's vertex to lamps, for the next bounce to follow."""
        return []
