"""The gallery's page: three pictures of each lamp, and the rooms."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from purelight_examples.gallery.shown import LampShown, RoomShown
from purelight_train.report.page import Row, Section, Shot, Warnings, write_page

TITLES = {
    "portrait": "The real lamp, switched off, path traced",
    "seen": "The asset, lit",
    "wall": "What it throws onto a wall",
}
LEAD = (
    "Every lamp was made by code, light traced, trained, exported, validated and rendered by "
    "purelight-gallery. Pictures are balanced towards the lamp's colour, each exposed for itself."
)


def write(
    path: Path, lamps: Sequence[LampShown], rooms: Sequence[RoomShown], faults: Sequence[str]
) -> None:
    """Write the page.

    Arguments:
        faults: a line for each lamp and room that failed.
    """
    sections: list[Section] = [Warnings(faults)] if faults else []
    sections += [_lamp(lamp) for lamp in lamps]
    for first in range(0, len(rooms), 2):
        sections.append(_rooms(rooms[first : first + 2]))
    write_page(path, "The gallery", LEAD, sections)


def _lamp(lamp: LampShown) -> Row:
    shots = []
    for kind, title in TITLES.items():
        image, grade = lamp.picture(kind)
        shots.append(Shot(title, grade.uri(image), lamp.figures() if kind == "seen" else {}))
    text = " ".join((lamp.entry.lamp.__doc__ or "").split("Arguments:")[0].split())
    return Row(lamp.entry.title, text, shots)


def _rooms(rooms: Sequence[RoomShown]) -> Row:
    shots = []
    for room in rooms:
        image, grade = room.picture()
        shots.append(Shot(room.name.replace("_", " ").capitalize(), grade.uri(image)))
    return Row("Rooms", "Lit by these lamps alone.", shots)
