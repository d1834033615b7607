"""A catalogue of thousands of lamps that are there already: what the catalogue itself costs.

One lamp is made; all others are the same file with another seed, so each has jobs of its own, and
is given the first one's results under their keys.
"""

from __future__ import annotations

import csv
import json
import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.catalogue.lamps import write_lamps
from benchmarks.catalogue.watch import ISSUED, catalogue, watch
from purelight_catalogue.engine import engine, run
from purelight_catalogue.entries import read_entries
from purelight_catalogue.jobs import Job, Settings, jobs_of
from purelight_catalogue.results import RECORD, Results
from purelight_format import atomic
from purelight_format.errors import PureLightError

WORKERS = 2
Figures = dict[str, Any]


def thousands(folder: Path, count: int, seed: int, preset: str) -> Figures:
    """Plan the jobs of so many lamps, have Dask ask for each, and make the catalogue of all.

    Raises:
        PureLightError: the one lamp that is made could not be.
    """
    (lamp,) = write_lamps(folder / "lamps", 1, seed)
    output = folder / "catalogue"
    words = ["--output", str(output), "--preset", preset]
    if watch(catalogue([str(_table(folder, lamp, 1)), *words], folder / "log.txt")).code:
        raise PureLightError(f"{lamp} could not be made; see {folder / 'log.txt'}")
    table = _table(folder, lamp, count)
    results = Results((output / "results").absolute())

    begun = time.process_time()
    work = {
        entry.name: jobs_of(entry, Settings(preset, issued=ISSUED)) for entry in read_entries(table)
    }
    planning = time.process_time() - begun
    first, *others = work.values()
    for jobs in others:
        for like, job in zip(first, jobs, strict=True):
            _give(results, like, job)

    asked = [job for jobs in work.values() for job in jobs]
    with engine(WORKERS, None) as client:
        begun = time.monotonic()
        ended = sum(not outcome.fault for outcome in run(client, asked, results.folder, folder))
        dask = time.monotonic() - begun
    whole = watch(catalogue([str(table), *words], folder / "log.txt"))
    kilobytes = {
        name: (output / name).stat().st_size / 1e3 / count
        for name in ("index.html", "catalogue.json", "catalogue.usda")
    }
    return {
        "lamps": count, "jobs": len(asked), "planning, ms a lamp": 1e3 * planning / count,
        "Dask, ms a job": 1e3 * dask / len(asked), "seconds, all found": whole.seconds,
        "gibibytes": whole.gibibytes, "kB a lamp": kilobytes,
        "as it ought to be": ended == len(asked) and whole.code == 0,
    }  # fmt: skip


def _table(folder: Path, lamp: str, count: int) -> Path:
    """The lamp so many times, by seeds of their own."""
    table = folder / "lamps" / "lamps.csv"
    with open(table, "w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(("file", "name", "seed"))
        rows.writerows((f"{lamp}/lamp.xml", f"lamp {n:05}", n) for n in range(count))
    return table


def _give(results: Results, like: Job, job: Job) -> None:
    """The result of a job like this one under this one's key; its files are the same on disk."""
    source, target = (results.path(one.stage, one.key) for one in (like, job))
    for path in filter(Path.is_file, source.rglob("*")):
        link = target / path.relative_to(source).with_name(path.name.replace(like.lamp, job.lamp))
        link.parent.mkdir(parents=True, exist_ok=True)
        if path.name != RECORD:
            os.link(path, link)
    done = results.done(like)
    assert done
    record = json.dumps(asdict(done) | {"key": job.key})
    atomic.write_bytes(target / RECORD, record.encode())
