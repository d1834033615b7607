"""What is known of one lamp so far: `figures.json` in its folder, stage by stage."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from purelight_format import atomic

ROOT = Path(__file__).parents[2]
SOURCES = ("purelight_format", "training", "exporters", "runtimes", "examples", "benchmarks")
STAGES = (
    "make", "train", "export", "validate",
    "flux", "floor", "reference", "far_field", "transmittance", "appearance", "sampler",
    "fast_map", "room", "near_field",
)  # fmt: skip
PORTRAIT = "portrait.png"
NEEDED = STAGES[:4]  # without one of these there is nothing to measure
Stage = dict[str, Any]


@dataclass
class Record:
    """Results of the stages of one lamp.

    Arguments:
        lamp: its description; `key`: of its files and of what is spent on it.
        stages: by name: processor seconds, code, and `figures`, or why there are none
            (`refused` by a stage in its own words, or `failed`).
        warnings: each once.
        running: the stage that has begun.
    """

    folder: Path
    key: str = ""
    lamp: dict[str, Any] = field(default_factory=dict)
    stages: dict[str, Stage] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    running: str | None = None

    @property
    def path(self) -> Path:
        return self.folder / "figures.json"

    @staticmethod
    def open(folder: Path) -> Record:
        """The record in a folder, empty if there is none yet."""
        record = Record(folder)
        if record.path.is_file():
            data = json.loads(record.path.read_text())
            for name, value in data.items():
                setattr(record, name, value)
        return record

    def save(self) -> None:
        data = {k: v for k, v in vars(self).items() if k != "folder"}
        self.folder.mkdir(parents=True, exist_ok=True)
        text = json.dumps(data, indent=2).replace(f"{self.folder}/", "")  # of this machine
        atomic.write_bytes(self.path, f"{text}\n".encode())

    def begin(self, stage: str) -> None:
        """Note that a stage has begun."""
        self.running = stage
        self.save()

    def end(self, stage: str, result: Stage) -> None:
        """Note how a stage has ended."""
        self.stages[stage] = result
        self.running = None
        self.save()

    def forget(self, stages: list[str]) -> None:
        """Drop results, so that they are made again; `failed` names all that have no figures."""
        for name in list(self.stages):
            bad = "figures" not in self.stages[name]
            if name in stages or ("failed" in stages and bad):
                del self.stages[name]

    @property
    def stopped(self) -> str | None:
        """Why a lamp has no figures at all, if it has none."""
        for name in NEEDED:
            stage = self.stages.get(name, {})
            for word in ("refused", "failed"):
                if word in stage:
                    return f"{name} {word}: {stage[word]}"
        return None

    def figures(self, stage: str) -> dict[str, Any]:
        """Figures of a stage, none if it has not ended well."""
        found: dict[str, Any] = self.stages.get(stage, {}).get("figures", {})
        return found


def code_digest() -> str:
    """A word that changes with any Python file of the product."""
    digest = hashlib.sha256()
    for source in SOURCES:
        for file in sorted((ROOT / source).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()[:12]
