"""PureLight: the exported bundle in our integrator."""

from __future__ import annotations

import json
from pathlib import Path

from benchmarks.systems.in_mitsuba import MitsubaSystem
from benchmarks.systems.protocol import Cost, Subject
from purelight_examples.scenes.lamp_choice import LampChoice, NeuralLamp

TRAINING = "training.json"  # beside the bundle: processor seconds by command


class PureLight(MitsubaSystem):
    """`mode` is accurate (the networks themselves) or fast (a map of 16 x 16 per point)."""

    def __init__(self, mode: str) -> None:
        self.mode = mode
        self.name = f"purelight_{mode}"
        self.label = f"PureLight, the exported bundle in its Mitsuba runtime, {mode} mode"

    def lamp(self, subject: Subject, folder: Path) -> LampChoice:
        """The bundle and the integrator `purelight`."""
        return NeuralLamp(subject.bundle.resolve(), self.mode)

    def prepare(self, subject: Subject, folder: Path) -> Cost:
        """What the public commands took and left; light that was traced to learn from included."""
        parts = json.loads(subject.bundle.with_name(TRAINING).read_text())
        return Cost(sum(parts.values()), subject.bundle.stat().st_size / 1e6, {"seconds": parts})
