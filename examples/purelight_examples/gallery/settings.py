"""What the gallery makes of its lamps, and how much is spent on it."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace

from purelight_examples.scenes.sensor import Picture
from purelight_train.presets import DRAFT, PRESETS, Optimisation, Preset

SKETCH = replace(
    DRAFT, name="sketch", photons=Optimisation(1000, 1 << 11, 1e-2), transparency_samples=1 << 20,
    transparency=Optimisation(300, 1 << 13, 5e-3), cap_points=1 << 14,
    sampler=Optimisation(300, 1 << 12, 5e-3), fast_map=Optimisation(200, 1 << 8, 1e-2),
)  # fmt: skip
GALLERY_PRESETS: dict[str, Preset] = {SKETCH.name: SKETCH, **PRESETS}
WALL, ROOM = Picture(320, 256, 64), Picture(400, 300, 64)


@dataclass(frozen=True)
class Settings:
    """Sizes and samples.

    Arguments:
        preset: of training, one of `GALLERY_PRESETS`: those of purelight-train, and `sketch`, a
            first look at every lamp in a quarter of the time of `draft`.
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
