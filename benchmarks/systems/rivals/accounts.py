"""What a system needed: seconds of the processor that survive a resumed call, and megabytes."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.systems.own.purelight import TRAINING
from benchmarks.systems.protocol import Subject
from purelight_format import atomic


def stage_seconds(subject: Subject) -> dict[str, float]:
    """Seconds of the processor by stage of the subject's own training.

    A run tells its stages by the clock, which other work on the machine stretches; the seconds of
    the processor are known of the whole command (`own.purelight.TRAINING`) and shared out.
    """
    stages = json.loads((subject.run / "metrics.json").read_text())["seconds"]
    told = subject.bundle.with_name(TRAINING)
    whole, total = sum(stages.values()), 0.0
    if told.is_file():
        total = float(json.loads(told.read_text()).get("training", 0.0))
    share = total / whole if whole > 0 and total > 0 else 1.0
    return {name: share * float(seconds) for name, seconds in stages.items()}


def megabytes(files: Iterable[Path]) -> float:
    """Size of files in MB of 10⁶ bytes."""
    return sum(file.stat().st_size for file in files) / 1e6


class Account:
    """Seconds of the processor by stage, in a file: interrupted work counts as well."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._file = folder / "seconds.json"

    @property
    def parts(self) -> dict[str, float]:
        """Seconds by stage so far."""
        return json.loads(self._file.read_text()) if self._file.is_file() else {}

    @property
    def total(self) -> float:
        """Of all stages."""
        return sum(self.parts.values())

    @contextmanager
    def stage(self, name: str) -> Iterator[Any]:
        """Add the seconds of what is done within."""
        start = time.process_time()
        try:
            yield
        finally:
            parts = self.parts
            parts[name] = round(parts.get(name, 0.0) + time.process_time() - start, 3)
            atomic.write_bytes(self._file, (json.dumps(parts) + "\n").encode())
