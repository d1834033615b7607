"""What the gallery makes of its lamps, and how much is spent on it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from purelight_examples.scenes.sensor import Picture

WALL, ROOM = Picture(320, 256, 64), Picture(400, 300, 64)


@dataclass(frozen=True)
class Settings:
    """Sizes and samples.

    Arguments:
        preset: of purelight-train; `sketch` is a first look.
        threads: processor threads.
        portrait: pixels a side of the lamp by daylight, path traced with `portrait_spp`.
        seen: pixels a side of the lamp itself, with `seen_spp` rays each.
        wall, room: pictures of the lamp lighting a wall, and of the rooms.
    """

    preset: str = "draft"
    threads: int = 2
    portrait: int = 256
    portrait_spp: int = 64
    seen: int = 256
    seen_spp: int = 16
    wall: Picture = WALL
    room: Picture = ROOM

    def to_json(self) -> str:
        """For another process."""
        return json.dumps(asdict(self))

    @staticmethod
    def from_json(text: str) -> Settings:
        """Inverse of `to_json`."""
        data = json.loads(text)
        return Settings(**{**data, **{k: Picture(**data[k]) for k in ("wall", "room")}})
