"""One room of the gallery, lit by the gallery's lamps."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from purelight_examples.demo import version
from purelight_examples.gallery.settings import Settings
from purelight_examples.scenes.interiors import INTERIORS
from purelight_examples.scenes.lamp_choice import NeuralLamp
from purelight_examples.stages import Figures, Record, Stage, run_stages


@dataclass(frozen=True)
class RoomJob:
    """A room with the lamps of a gallery.

    Arguments:
        gallery: folder of the whole gallery; the room's is `rooms/<name>` in it.
    """

    name: str
    gallery: Path
    settings: Settings

    def __call__(self) -> dict[str, Record]:
        """Render the room unless it is done; returns its record."""
        self.folder.mkdir(parents=True, exist_ok=True)
        picture = self.settings.room
        key = {
            "lamps": {lamp: _digest(self.bundle(lamp)) for lamp in self.lamps},
            "scene": repr(INTERIORS[self.name]), "version": version(),
            "picture": [picture.width, picture.height, picture.spp],
        }  # fmt: skip
        output = (self.folder / "room.exr",)
        return run_stages(
            self.folder, [Stage("room", "Rendering the room", 60, key, self._render, output)]
        )

    @property
    def folder(self) -> Path:
        return self.gallery / "rooms" / self.name

    @property
    def lamps(self) -> list[str]:
        """Names of the lamps that it needs."""
        return list(INTERIORS[self.name].places())

    def bundle(self, lamp: str) -> Path:
        """Of one of them."""
        return self.gallery / lamp / "lamp.plux"

    def _render(self, done: dict[str, Record]) -> Figures:
        from purelight_examples import rendering
        from purelight_onnx.picture import write_exr

        lamps = {lamp: NeuralLamp(self.bundle(lamp)) for lamp in self.lamps}
        scene = INTERIORS[self.name].write(self.folder, lamps, self.settings.room)
        rendered = rendering.render(scene, self.settings.room.spp, self.name)
        write_exr(self.folder / "room.exr", rendered.image)
        return {"seconds": rendered.seconds}


def _digest(file: Path) -> str:
    return hashlib.sha256(file.read_bytes()).hexdigest()
