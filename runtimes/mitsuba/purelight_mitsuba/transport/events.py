"""What becomes of a path where it meets a lamp: it goes straight on, or has a vertex there."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_mitsuba.lamps.finishes import Look


@dataclass
class Event:
    """What was drawn.

    Arguments:
        weight: For the throughput.
        stops: Whether the path has a vertex at the lamp.
        ahead, back: Whether it is scattered there so, rather than reflected.
        inside: Whether that vertex is on the lamp's far wall.
        u: A fresh uniform number.
    """

    weight: mi.Color3f
    stops: mi.Bool
    ahead: mi.Bool
    back: mi.Bool
    inside: mi.Bool
    u: mi.Float


@dataclass
class Stop:
    """A vertex that a path has at a lamp, if it is active.

    Arguments:
        found: Where, as Mitsuba notes it.
        u: A uniform number for the next lamp's event.
    """

    found: mi.PreliminaryIntersection3f
    active: mi.Bool
    u: mi.Float

    @staticmethod
    def none(u: mi.Float) -> Stop:
        return Stop(dr.zeros(mi.PreliminaryIntersection3f), mi.Bool(False), u)


@dataclass
class Parts:
    """What a lamp makes of light from all around; the sum is at most one.

    Arguments:
        reflected: About so much is reflected where the lamp is met.
        ahead: Goes on ahead, but not straight.
        back: Comes back from inside of a body.
        inside: Reaches the far wall of a hollow, to be reflected there.
        straight: Comes from straight behind.
    """

    reflected: mi.Color3f
    ahead: mi.Color3f
    back: mi.Color3f
    inside: mi.Color3f
    straight: mi.Color3f

    @staticmethod
    def of(
        look: Look,
        cosine: mi.Float,
        transmittance: mi.Color3f,
        far: mi.Color3f | None = None,
    ) -> Parts:
        """Eqs. 21 to 23; without a finish all goes straight.

        Arguments:
            cosine: Of the angle to the normal.
            far: Reflectance of the far wall, if there may be one.
        """
        kept = look.kept(cosine)
        reflected = look.reflectance(cosine) + kept * look.diffuse
        ahead, back = kept * look.ahead, kept * look.back
        left = dr.maximum(1 - reflected - ahead - back, 0)
        far = mi.Color3f(0) if far is None else far
        reached = dr.minimum(transmittance / dr.maximum(1 - far, 1e-6), left)
        reached = dr.select(look.opaque, 0, reached)
        passing = reached * (1 - far)
        inside = dr.select(dr.max(far) > 0, reached * (1 - look.spread), 0)
        return Parts(
            dr.select(look.known, reflected, 0),
            dr.select(look.known, ahead + passing * look.spread, 0),
            dr.select(look.known, back, 0),
            dr.select(look.known, inside, 0),
            dr.select(look.known, passing * (1 - look.spread), transmittance),
        )

    def draw(self, u: mi.Float, far: mi.Color3f | None = None) -> Event:
        """Draws one of them by its largest channel; the far wall counts for what it mirrors."""
        inside = self.inside if far is None else self.inside * far
        values = (self.reflected, self.ahead, self.back, inside, self.straight)
        steps, total = [], mi.Float(0)
        for value in values:
            steps.append(total)
            total = total + dr.max(value)
        edges = [step / total for step in steps] + [mi.Float(1)]
        drawn = [
            (u >= low) & (u < high)
            for low, high in itertools.pairwise(edges)
        ]  # fmt: skip
        worth = (mi.Color3f(1), self.ahead, self.back, self.inside, self.straight)
        weight, fresh = mi.Color3f(0), mi.Float(0)
        for chosen, value, low, high in zip(drawn, worth, edges, edges[1:], strict=False):
            weight = dr.select(chosen, value / (high - low), weight)
            fresh = dr.select(chosen, (u - low) / (high - low), fresh)
        bounces, goes_ahead, comes_back, within, _ = drawn
        stops = bounces | goes_ahead | comes_back | within
        weight = dr.select(total > 0, weight, 0)
        return Event(weight, stops, goes_ahead, comes_back, within, dr.clip(fresh, 0, 1 - 1e-7))
