"""Light on its way to the pixel, as a whole and by light groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from purelight_format.errors import PureLightError
from purelight_mitsuba.lamps.emitter import PureLightEmitter

OTHERS, OTHERS_NAME = 0, "others"  # The group of Mitsuba's own emitters.


def group_names(emitters: Sequence[PureLightEmitter]) -> list[str]:
    """The light groups of a scene: that of Mitsuba's emitters, and those of its lamps in order.

    Raises:
        PureLightError: A lamp's group has the name of Mitsuba's emitters.
    """
    names = list(dict.fromkeys(e.light_group for e in emitters))
    if OTHERS_NAME in names:
        raise PureLightError(
            f"light_group {OTHERS_NAME} is that of Mitsuba's own emitters; choose another name"
        )
    return [OTHERS_NAME, *names]


@dataclass
class Light:
    """Light of each lane, W/(m² sr).

    Arguments:
        total: All of it.
        groups: What each light group adds to it; empty unless somebody asked, and then free.
        spoilt: How many answers of networks were infinite or no number, and count as dark in it.
    """

    total: mi.Color3f
    groups: list[mi.Color3f]
    spoilt: mi.UInt32

    @staticmethod
    def dark(groups: int, width: int = 1) -> Light:
        """No light yet."""
        total, *parts = (dr.zeros(mi.Color3f, width) for _ in range(1 + groups))
        return Light(total, parts, dr.zeros(mi.UInt32, width))

    def __add__(self, other: Light) -> Light:
        pairs = zip(self.groups, other.groups, strict=True)
        groups = [a + b for a, b in pairs]
        return Light(self.total + other.total, groups, self.spoilt + other.spoilt)

    def add(self, value: mi.Color3f, group: int | mi.UInt32 = OTHERS) -> Light:
        """This and the light of one group."""
        groups = [
            part + dr.select(mi.UInt32(group) == index, value, 0)
            for index, part in enumerate(self.groups)
        ]
        return Light(self.total + value, groups, self.spoilt)

    def spoil(self, answers: mi.UInt32) -> Light:
        """This, with so many more spoilt answers."""
        return Light(self.total, self.groups, self.spoilt + answers)

    def scatter(self, other: Light, lane: mi.UInt32) -> None:
        """Adds other lanes' light to lanes, in place.

        On a processor the kernel that adds holds the number of lanes. It is one of its own, lest
        the networks are in it, and are compiled again for pictures of another size.
        """
        dr.eval(other, lane)
        dr.scatter_add(self.total, other.total, lane)
        for part, more in zip(self.groups, other.groups, strict=True):
            dr.scatter_add(part, more, lane)
        dr.scatter_add(self.spoilt, other.spoilt, lane, other.spoilt > 0)
