"""All lamps of a zoo in tables: each figure, how it is distributed, and where it is worst."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.zoo.columns import COLUMNS, Column
from benchmarks.zoo.record import Record

WORST = 5
Rows = dict[str, Record]


def markdown(records: Rows) -> str:
    """The tables as text."""
    measured = {n: r for n, r in records.items() if r.stages and not r.stopped}
    parts = [
        f"{len(records)} lamps, {len(measured)} measured, code "
        f"{', '.join(sorted(codes(records))) or '-'}",
        _lamps(measured),
        "Distribution of each figure's size (of what ought to be large: of the value), and where "
        "it is worst:",
        _distributions(measured),
        "Median of the size by family:",
        _families(measured),
        *_troubles(records),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def summary(records: Rows) -> dict[str, Any]:
    """JSON-ready: values by lamp, distributions by column, and what went wrong."""
    measured = {n: r for n, r in records.items() if r.stages and not r.stopped}
    return {
        "codes": sorted(codes(records)),
        "lamps": {
            name: {"lamp": record.lamp, **{c.title: c.value(record) for c in COLUMNS}}
            for name, record in records.items()
        },
        "distributions": {c.title: distribution(c, measured) for c in COLUMNS},
        "stopped": {n: r.stopped for n, r in records.items() if r.stopped},
        "unmeasured": {n: unmeasured(r) for n, r in records.items() if unmeasured(r)},
        "warnings": {n: r.warnings for n, r in records.items() if r.warnings},
    }


def distribution(column: Column, records: Rows) -> dict[str, Any] | None:
    """Median, 90th percentile and worst of a column, and the lamps where it is worst."""
    known = {n: v for n, r in records.items() if (v := column.value(r)) is not None}
    if not known:
        return None
    order = sorted(known, key=lambda name: column.badness(known[name]), reverse=True)
    size = np.array([column.badness(known[name]) for name in order])
    sign = -1 if column.badness(1.0) < 0 else 1
    median, ninth = (float(sign * q) for q in np.quantile(size, (0.5, 0.9)))
    within = None if column.bar is None else int((size <= column.bar).sum())
    return {
        "lamps": len(known),
        "within_bar": within,
        "median": median,
        "ninetieth": ninth,
        "worst": float(sign * size[0]),
        "worst_lamps": {name: known[name] for name in order[:WORST]},
    }


def unmeasured(record: Record) -> dict[str, str]:
    """Stages after the training that gave no figures, and why."""
    return {
        name: stage.get("refused") or stage["failed"]
        for name, stage in record.stages.items()
        if "figures" not in stage and not record.stopped
    }


def codes(records: Rows) -> set[str]:
    """Versions of the code that the figures are of."""
    return {code for r in records.values() for code in _codes(r)}


def _codes(record: Record) -> list[str]:
    """Versions of the code that a lamp's figures are of, the oldest first."""
    return list(dict.fromkeys(s["code"] for s in record.stages.values() if "code" in s))


def _lamps(records: Rows) -> str:
    head = ["lamp", "code", "traits", "R / m", "lights", *(c.title for c in COLUMNS)]
    rows = [
        [
            name, " ".join(code[:4] for code in _codes(record)),
            " ".join(record.lamp["traits"]), f"{record.lamp['radius_metres']:.3g}",
            str(record.lamp["emitters"]), *(c.cell(record) for c in COLUMNS),
        ]
        for name, record in records.items()
    ]  # fmt: skip
    return _table(head, rows)


def _distributions(records: Rows) -> str:
    rows = []
    for column in COLUMNS:
        found = distribution(column, records)
        if found is None:
            continue
        style = column.style.lstrip("+")
        numbers = [format(found[k], style) for k in ("median", "ninetieth", "worst")]
        worst = ", ".join(f"{n} {v:{column.style}}" for n, v in found["worst_lamps"].items())
        within = "" if column.bar is None else f"{found['within_bar']} by {column.bar:g}"
        rows.append([column.title, str(found["lamps"]), within, *numbers, worst])
    head = ["figure", "lamps", "within", "median", "90 %", "worst", "worst lamps"]
    return _table(head, rows)


def _families(records: Rows) -> str:
    rows = []
    for family in sorted({r.lamp["family"] for r in records.values()}):
        kin = {n: r for n, r in records.items() if r.lamp["family"] == family}
        cells = []
        for column in COLUMNS:
            found = distribution(column, kin)
            style = column.style.lstrip("+")
            cells.append("-" if found is None else format(found["median"], style))
        rows.append([family, str(len(kin)), *cells])
    return _table(["family", "lamps", *(c.title for c in COLUMNS)], rows)


def _troubles(records: Rows) -> list[str]:
    """Lists of what was refused, what failed, and what was warned of."""
    kinds: dict[str, Callable[[Record], Sequence[str]]] = {
        "Lamps without figures:": lambda r: [r.stopped] if r.stopped else [],
        "Figures that could not be made:": lambda r: [
            f"{stage}: {why}" for stage, why in unmeasured(r).items()
        ],
        "Warnings:": lambda r: r.warnings,
    }
    lists = []
    for title, tell in kinds.items():
        lines = [f"- {name}: {text}" for name, r in records.items() for text in tell(r)]
        if lines:
            lists.append("\n".join((title, "", *lines)))
    return lists


def _table(head: list[str], rows: list[list[str]]) -> str:
    if not rows:
        return ""
    lines = ["| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])
