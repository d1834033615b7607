"""What was measured: JSON lines, one a (lamp, system, task, samples), a file for each lamp."""

from __future__ import annotations

import json
import math
import os
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.systems.protocol import Image

NAME = "records.jsonl"


@dataclass(frozen=True)
class Record:
    """One picture's figures, or why there is none.

    Arguments:
        lamp, system, task: by name; without system and task it tells why a lamp has no figures.
        key: of all that the figures depend on; `code`: of the product's source.
        kind: of the task.
        samples: per pixel; 0 where there is no picture.
        seconds: of the processor where it is known and threads are one, else by the clock.
        clock, warm_up: wall-clock, see `protocol.Frame`.
        memory: peak of the process that rendered, in MB; None if not known.
        cost: of `protocol.Cost`: seconds, megabytes, parts.
        figures: see `errors.measure`.
        picture: its file, relative to the records.
        last: whether the series ends with it.
        failed: one line.
        threads: that the system was given; 0 if not told.
    """

    lamp: str
    system: str
    task: str
    key: str
    code: str = ""
    kind: str = ""
    samples: int = 0
    seconds: float = 0.0
    clock: float = 0.0
    warm_up: float = 0.0
    memory: float | None = None
    cost: dict[str, Any] = field(default_factory=dict)
    figures: dict[str, Any] = field(default_factory=dict)
    picture: str = ""
    last: bool = False
    failed: str = ""
    threads: int = 0

    @property
    def series(self) -> tuple[str, str, str]:
        """Lamp, system and task."""
        return self.lamp, self.system, self.task

    def image(self, folder: Path) -> Image:
        """The picture, of records in a folder."""
        with np.load(folder / self.picture) as data:
            return data["image"].astype(np.float64)

    def figure(self, name: str) -> float | None:
        """A figure that is a finite number, or None."""
        value = self.figures.get(name)
        good = isinstance(value, int | float) and math.isfinite(value)
        return float(value) if good else None  # type: ignore[arg-type]


class Records:
    """The lines of the lamps' files; a later run of a series replaces the earlier ones.

    A run ends with its `last` record. One that was interrupted ends where a record has another
    key, or not more samples than the one before: each run of a series begins anew.

    A lamp has a file of its own, so that several may be measured at once.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        texts = [path.read_text() for path in sorted(folder.glob(f"*/{NAME}"))]
        self.lines = [r for text in texts for t in text.splitlines() if (r := _read(t))]

    def path(self, lamp: str) -> Path:
        """The file of a lamp."""
        return self.folder / lamp / NAME

    def add(self, record: Record) -> None:
        """Append a line, which is on the disk when this returns."""
        self.lines.append(record)
        path = self.path(record.lamp)
        path.parent.mkdir(parents=True, exist_ok=True)
        whole = not path.is_file() or path.read_bytes()[-1:] in (b"\n", b"")
        with open(path, "ab") as file:
            text = json.dumps(asdict(record), allow_nan=False, default=float)
            file.write((b"" if whole else b"\n") + text.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())

    def ended(self, series: tuple[str, str, str], key: str) -> bool:
        """Whether the last run of a series has this key and came to its end, good or bad."""
        run = _last_run([r for r in self.lines if r.series == series])
        return bool(run) and run[-1].key == key and run[-1].last

    def current(self) -> list[Record]:
        """What counts: of each series the last run, one record for each number of samples."""
        lines: dict[tuple[str, str, str], list[Record]] = {}
        for record in self.lines:
            lines.setdefault(record.series, []).append(record)
        counting = {id(r) for series in lines.values() for r in _last_run(series)}
        return [r for r in self.lines if id(r) in counting]


def _last_run(lines: list[Record]) -> list[Record]:
    """The records of one series that its last run made."""
    run: list[Record] = []
    for record in lines:
        before = run[-1] if run else None
        goes_on = before is not None and record.key == before.key and not before.last
        if goes_on and (record.failed or record.samples > run[-1].samples):
            run.append(record)
        else:
            run = [record]
    return run


def _read(text: str) -> Record | None:
    """A line's record; None for one that an interruption cut off."""
    try:
        return Record(**json.loads(text))
    except (ValueError, TypeError):
        return None


def plain(value: Any) -> Any:
    """Figures as JSON has them: numbers that are not finite become None."""
    if isinstance(value, dict):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
