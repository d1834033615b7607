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
    lines = []
    if len(lamp.parts) > 1:
        boxes = np.stack([part.mesh.bounds for part in lamp.parts])
        for part, box, rest in zip(lamp.parts, boxes, _others(boxes), strict=True):
            if kind := _kind(part, box, rest):
                lines.append(
                    f"'{part.name}' ({kind}) seems to belong to the room: leave it out with --omit "
                    f"'{part.name}', or keep it apart with --keep '{part.name}'"
                )
    if lamp.room:
        names = ", ".join(lamp.room[:4])
        lines.append(f"light from infinity is left out, as no lamp gives it ({names})")
    return lines


def _others(boxes: Floats) -> Floats:
    """The box around all boxes [P, 2, 3] but one, for each: [P, 2, 3]."""
    least, most = np.minimum.accumulate, np.maximum.accumulate
    wall = np.full((1, 3), np.inf)
    low, high = boxes[:, 0], boxes[:, 1]
    before = np.concatenate((wall, least(low)[:-1])), np.concatenate((-wall, most(high)[:-1]))
    after = (
        np.concatenate((least(low[::-1])[::-1][1:], wall)),
        np.concatenate((most(high[::-1])[::-1][1:], -wall)),
    )
    return np.stack((np.minimum(before[0], after[0]), np.maximum(before[1], after[1])), 1)


def _kind(part: Part, box: Floats, rest: Floats) -> str:
    """Whether a part is a floor or cable by its size; "" if neither."""
    if part.radiance is not None:
        return ""
    others, own = np.ptp(rest, axis=0), np.ptp(box, axis=0)
    if _is_sheet(own) and _larger(own, others, 1.2 if NAMES.search(part.name) else LARGER):
        return "a large flat sheet"
    top = max(box[1, 2], rest[1, 2])
    height = float(top - min(box[0, 2], rest[0, 2]))
    thin = own[:2].max() < CABLE_WIDTH * own[2]
    at_top = box[1, 2] > top - 0.01 * height
    short = others[2] < (1 - CABLE_HEIGHT / 2) * height
    return (
        "a long cable or rod"
        if thin and at_top and short and own[2] > CABLE_HEIGHT * height
        else ""
    )


def _is_sheet(size: Floats) -> bool:
    least, middle, _ = np.sort(size)
    return bool(least < FLAT * middle)


def _larger(size: Floats, others: Floats, factor: float) -> bool:
    """Whether the two long sides are longer than what else there is along them."""
    wide = np.argsort(size)[1:]
    return bool((size[wide] > factor * others[wide]).all())
