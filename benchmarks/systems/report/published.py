"""What is published of a lamp: its records as CSV, which a later report reads back."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.systems.records import Record
from purelight_format.errors import PureLightError

WORDS = ("lamp", "system", "task", "kind", "code")
COUNTS = ("samples", "threads")
NUMBERS = ("seconds", "clock", "warm_up")
COST = {"precompute_seconds": "seconds", "stored_megabytes": "megabytes"}  # a cost's by column
HEAD = (*WORDS, *COUNTS, *NUMBERS, "memory", *COST)  # and figures, and why there are none
FAILED = "failed"


def to_csv(records: Sequence[Record]) -> str:
    """Records as CSV; columns are the figures that any of them has, lists are JSON."""
    records = [r for r in records if r.system or r.failed]
    names = list(dict.fromkeys(n for r in records for n in r.figures))
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow([*HEAD, *names, FAILED])
    for r in records:
        own = [getattr(r, n) for n in (*WORDS, *COUNTS, *NUMBERS, "memory")]
        row = (*own, *(r.cost.get(n) for n in COST.values()), *(r.figures.get(n) for n in names))
        writer.writerow([_text(value) for value in (*row, r.failed)])
    return buffer.getvalue()


def from_csv(text: str) -> list[Record]:
    """Records of such a text, to its six digits; without keys and pictures.

    Raises:
        ValueError: it is no such text.
    """
    head, *rows = [*csv.reader(io.StringIO(text), strict=True)] or [[]]
    if (*head[: len(HEAD)], *head[-1:]) != (*HEAD, FAILED):
        raise ValueError("its columns are others")
    return [_record(dict(zip(head, row, strict=True))) for row in rows]


def records(folder: Path, without: Collection[str]) -> list[Record]:
    """Records of the lamps that a folder of `series_LAMP.csv` holds, but for some.

    Raises:
        PureLightError: a file is none that was published.
    """
    found: list[Record] = []
    for path in sorted(folder.glob("series_*.csv")):
        if path.stem.removeprefix("series_") in without:
            continue
        try:
            found += from_csv(path.read_text())
        except (ValueError, csv.Error) as error:
            raise PureLightError(
                f"{path}: not published by this benchmark ({error}); delete it, or publish its lamp"
            ) from error
    return found


def _record(row: Mapping[str, str]) -> Record:
    known = {n: row[n] for n in (*WORDS, FAILED)}
    numbers = {n: float(row[n]) for n in NUMBERS} | {n: int(row[n] or 0) for n in COUNTS}
    memory = float(row["memory"]) if row["memory"] else None
    cost = {name: float(row[n]) for n, name in COST.items() if row[n]}
    figures = {n: _value(text) for n, text in row.items() if n not in (*HEAD, FAILED) and text}
    values: dict[str, Any] = {**known, **numbers, "memory": memory, "cost": cost}
    return Record(**values, key="", figures=figures)


def _value(text: str) -> Any:
    return json.loads(text) if text.startswith("[") else float(text)


def _text(value: object) -> object:
    if isinstance(value, list):
        return json.dumps([v if v is None else float(f"{v:.6g}") for v in value])
    return f"{value:.6g}" if isinstance(value, float) else ("" if value is None else value)
