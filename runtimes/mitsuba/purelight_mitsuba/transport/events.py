"""What becomes of a path where it meets a lamp: it goes straight on, or has a vertex there."""

from __future__ import annotations

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
        spreading: Whether it goes on ahead from there, rather than back.
        u: A fresh uniform number.
    """

    weight: mi.Color3f
    stops: mi.Bool
    spreading: mi.Bool
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
    """What a finish makes of light from all around, of a known transmittance.

    Arguments:
        reflected: About so much of it; the sum of all is at most one.
        spread: Goes on ahead, but not straight.
        straight: Comes from straight behind.
    """

    reflected: mi.Color3f
    spread: mi.Color3f
    straight: mi.Color3f

    @staticmethod
    def of(look: Look, cosine: mi.Float, transmittance: mi.Color3f) -> Parts:
        """Eqs. 21 and 22; without a finish all goes straight."""
        kept = look.kept(cosine)
        reflected = look.reflectance(cosine) + kept * look.diffuse
        ahead = kept * look.through
        passing = dr.minimum(transmittance, dr.maximum(1 - reflected - ahead, 0))
        passing = dr.select(look.opaque, 0, passing)
        return Parts(
            dr.select(look.known, reflected, 0),
            dr.select(look.known, ahead + passing * look.spread, 0),
            dr.select(look.known, passing * (1 - look.spread), transmittance),
        )

    def draw(self, u: mi.Float) -> Event:
        """Draws one of the three in proportion to its largest channel."""
        reflected, spread, straight = map(dr.max, (self.reflected, self.spread, self.straight))
        total = reflected + spread + straight
        first, second = reflected / total, (reflected + spread) / total
        back, ahead = u < first, (u >= first) & (u < second)
        low, high = (
            dr.select(back, 0, dr.select(ahead, first, second)),
            dr.select(back, first, dr.select(ahead, second, 1)),
        )
        chance = high - low
        value = dr.select(back, 1, dr.select(ahead, self.spread, self.straight))
        weight = dr.select((total > 0) & (chance > 0), value / chance, 0)
        return Event(weight, back | ahead, ahead, dr.clip((u - low) / chance, 0, 1 - 1e-7))
