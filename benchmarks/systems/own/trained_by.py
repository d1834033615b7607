"""PureLight by another preset than the scale's: what a longer training buys."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.systems.own.purelight import TRAINING, PureLight
from benchmarks.systems.protocol import Cost, Subject
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp

BUNDLE = "lamp.plux"


class TrainedBy(PureLight):
    """Accurate mode of a bundle that a named preset made, whatever the scale's is."""

    def __init__(self, preset: str) -> None:
        super().__init__("accurate")
        self.preset = preset
        self.name = f"purelight_{preset}"
        self.label = f"PureLight trained by the preset `{preset}`, accurate mode"

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The bundle that `prepare` made, and the integrator `purelight`."""
        return NeuralLamp((folder / BUNDLE).resolve(), self.mode)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """Train and export by the public commands, going on with what an earlier call left."""
        from benchmarks.systems import subjects  # training's, which no rendering has to hold

        told = folder / TRAINING
        if not told.is_file():
            for _ in subjects.make(subject.scene, folder, self.preset, subject.threads, self.name):
                pass
        parts = json.loads(told.read_text())
        return Cost(sum(parts.values()), (folder / BUNDLE).stat().st_size / 1e6, parts)
