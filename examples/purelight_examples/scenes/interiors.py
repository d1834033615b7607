"""The rooms of the gallery by name."""

from __future__ import annotations

from purelight_examples.scenes.bedroom import Bedroom
from purelight_examples.scenes.cornell_box import CornellBox
from purelight_examples.scenes.dining_room import DiningRoom
from purelight_examples.scenes.elevator_hall import ElevatorHall
from purelight_examples.scenes.interior import Interior
from purelight_examples.scenes.kitchen import Kitchen

_ROOMS: tuple[Interior, ...] = (
    CornellBox(), Kitchen(), ElevatorHall(), Bedroom(), DiningRoom(),
)  # fmt: skip
INTERIORS = {room.name: room for room in _ROOMS}
