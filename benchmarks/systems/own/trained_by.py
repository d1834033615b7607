"""PureLight by another preset than the scale's: what a longer training buys."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from benchmarks.systems.own.purelight import TRAINING, PureLight
from benchmarks.systems.protocol import Cost, Subject
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp

BUNDLE, MADE = "lamp.plux", "lamp.json"  # what `subjects.make` leaves


class TrainedBy(PureLight):
    """A mode of a bundle that a named preset made, whatever the scale's is.

    The modes of a preset share one training, in the folder of the accurate one.
    """

    def __init__(self, preset: str, mode: str = "accurate") -> None:
        super().__init__(mode)
        self.preset = preset
        self.shared = f"purelight_{preset}"
        self.name = self.shared if mode == "accurate" else f"{self.shared}_{mode}"
        self.label = f"PureLight trained by the preset `{preset}`, {mode} mode"

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The bundle that `prepare` made, and the integrator `purelight`."""
        return NeuralLamp((self._trained(folder) / BUNDLE).resolve(), self.mode)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Train and export by the public commands, going on with what an earlier call left."""
        from benchmarks.systems import subjects  # training's, which no rendering has to hold

        trained = self._trained(folder)
        lamp = json.loads(subject.bundle.with_name(MADE).read_text())["key"]
        words = repr((lamp, subjects.ALL_PRESETS[self.preset]))
        key = hashlib.sha256(words.encode()).hexdigest()[:16]
        if not _made(trained, key):
            trained.mkdir(exist_ok=True)
            for _ in subjects.make(subject.scene, trained, self.preset, subject.threads, key):
                pass
        parts = json.loads((trained / TRAINING).read_text())
        return Cost(sum(parts.values()), (trained / BUNDLE).stat().st_size / 1e6, parts)

    def _trained(self, folder: Path) -> Path:
        return folder.with_name(self.shared)


def _made(folder: Path, key: str) -> bool:
    """Whether a lamp and a preset of this key were trained and exported there to the end."""
    made = folder / MADE
    return made.is_file() and json.loads(made.read_text())["key"] == key
