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
        inside: Whether that vertex is on the lamp's far wall.
        u: A fresh uniform number.
    """

    weight: mi.Color3f
    stops: mi.Bool
    spreading: mi.Bool
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
        spread: Goes on ahead, but not straight.
        inside: Reaches the far wall of a hollow, to be reflected there.
        straight: Comes from straight behind.
    """

    reflected: mi.Color3f
    spread: mi.Color3f
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
        ahead = kept * look.through
        left = dr.maximum(1 - reflected - ahead, 0)
        reached = dr.minimum(transmittance, left)
        passing, inside = reached, mi.Color3f(0)
        if far is not None:
            reached = dr.minimum(transmittance / dr.maximum(1 - far, 1e-6), left)
            passing = reached * (1 - far)
            inside = dr.select(dr.max(far) > 0, reached * (1 - look.spread), 0)
        passing = dr.select(look.opaque, 0, passing)
        return Parts(
            dr.select(look.known, reflected, 0),
            dr.select(look.known, ahead + passing * look.spread, 0),
            dr.select(look.known & ~look.opaque, inside, 0),
            dr.select(look.known, passing * (1 - look.spread), transmittance),
        )

    def draw(self, u: mi.Float, far: mi.Color3f | None = None) -> Event:
        """Draws one of the four by its largest channel; what comes of the far wall counts there."""
        worth = self.inside * far if far is not None else self.inside
        values = (self.reflected, self.spread, worth, self.straight)
        back, ahead, within, through = map(dr.max, values)
        total = back + ahead + within + through
        first, second, third = back / total, (back + ahead) / total, 1 - through / total
        bounces, spreads = u < first, (u >= first) & (u < second)
        inside = (u >= second) & (u < third) & (within > 0)
        low = dr.select(bounces, 0, dr.select(spreads, first, dr.select(inside, second, third)))
        high = dr.select(bounces, first, dr.select(spreads, second, dr.select(inside, third, 1)))
        chance = high - low
        value = dr.select(spreads, self.spread, dr.select(inside, self.inside, self.straight))
        value = dr.select(bounces, 1, value)
        weight = dr.select((total > 0) & (chance > 0), value / chance, 0)
        fresh = dr.clip((u - low) / chance, 0, 1 - 1e-7)
        return Event(weight, bounces | spreads | inside, spreads, inside, fresh)
