"""What a system needed: seconds of the processor that survive a resumed call, and megabytes."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from purelight_format import atomic


def light_seconds(run: Path) -> float:
    """Seconds in which a run's light was traced."""
    metrics = json.loads((run / "metrics.json").read_text())
    return float(metrics["seconds"].get("light", 0.0))


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
