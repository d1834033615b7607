"""Parts that seem to be of a room, not of a lamp: a floor, walls, a cable to the ceiling."""

from __future__ import annotations

import re

import numpy as np

from purelight_import.model.lamp import Lamp, Part
from purelight_import.model.mesh import Floats

LARGER, FLAT = 3.0, 0.05  # than the rest; thickness over width
CABLE_HEIGHT, CABLE_WIDTH = 0.5, 0.06  # of the lamp's height
NAMES = re.compile(r"floor|ground|wall|ceiling|backdrop|room|plane|cyclorama", re.IGNORECASE)


def room_lines(lamp: Lamp) -> list[str]:
    """What seems not to belong to the lamp, and what to do about it."""
    lines = [
        f"'{part.name}' ({kind}) seems to belong to the room: leave it out with --omit "
        f"'{part.name}', or keep it apart with --keep '{part.name}'"
        for part in lamp.parts if (kind := _kind(part, lamp))
    ]  # fmt: skip
    if lamp.room:
        names = ", ".join(lamp.room[:4])
        lines.append(f"light from infinity is left out, as no lamp gives it ({names})")
    return lines


def _kind(part: Part, lamp: Lamp) -> str:
    """Whether a part is a floor or cable by its size; "" if neither."""
    rest = [p.mesh.bounds for p in lamp.parts if p is not part]
    if not rest or part.radiance is not None:
        return ""
    box = np.concatenate(rest)
    others, own = np.ptp(box, axis=0), np.ptp(part.mesh.bounds, axis=0)
    if _is_sheet(own) and _larger(own, others, 1.2 if NAMES.search(part.name) else LARGER):
        return "a large flat sheet"
    height = float(np.ptp(lamp.bounds[:, 2]))
    thin = own[:2].max() < CABLE_WIDTH * own[2]
    at_top = part.mesh.bounds[1, 2] > lamp.bounds[1, 2] - 0.01 * height
    if (
        thin
        and at_top
        and own[2] > CABLE_HEIGHT * height
        and others[2] < (1 - CABLE_HEIGHT / 2) * height
    ):
        return "a long cable or rod"
    return ""


def _is_sheet(size: Floats) -> bool:
    least, middle, _ = np.sort(size)
    return bool(least < FLAT * middle)


def _larger(size: Floats, others: Floats, factor: float) -> bool:
    """Whether the two long sides are longer than what else there is along them."""
    wide = np.argsort(size)[1:]
    return bool((size[wide] > factor * others[wide]).all())
