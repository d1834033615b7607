"""A zoo whose figures are kept in the repository: written there, and gone on from later."""

from __future__ import annotations

import shutil
from pathlib import Path

from benchmarks.zoo.record import PORTRAIT, Record
from benchmarks.zoo.runner import Job
from purelight_format import atomic

PUBLISHED = Path(__file__).parents[1] / "results" / "zoo"


def publish(folder: Path, to: Path = PUBLISHED) -> None:
    """Copy a seed's tables, portraits and measured records out of its folder, into `to`/SEED.

    Portraits stay as they are where some lamps were not made here (`recall`).
    """
    target, made_here = to / folder.name, True
    for file in sorted(folder.glob("*/figures.json")):
        record = Record.open(file.parent)
        if record.stopped or "room" in record.stages:
            atomic.write_bytes(target / f"{file.parent.name}.json", file.read_bytes())
        made_here &= bool(record.stopped) or (file.parent / PORTRAIT).is_file()
    for name in ("zoo.md", "zoo.png")[: 1 + made_here]:
        if (folder / name).is_file():
            atomic.write_bytes(target / name, (folder / name).read_bytes())


def recall(job: Job, of: Path = PUBLISHED) -> bool:
    """Give a job the record that is published of it, if its folder has none; whether it did.

    One of another lamp or of other settings is left, and so is one that lacks a wanted stage, for
    which its bundle would be needed.
    """
    kept = of / str(job.lamp.seed) / f"{job.lamp.name}.json"
    if not kept.is_file() or Record(job.folder).path.is_file():
        return False
    job.folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(kept, Record(job.folder).path)
    if Record.open(job.folder).key == job.key() and not job.missing:
        return True
    Record(job.folder).path.unlink()
    return False
