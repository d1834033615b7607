"""Tables of lamps x systems."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from benchmarks.systems.protocol import System
from benchmarks.systems.report.series import (
    FLOOR,
    GLARE,
    KINDS,
    OURS,
    PREFIXES,
    Results,
    Step,
    at,
)

HEAD = (
    "lamp", "system", "MAPE", "(truth)", "relMSE", "FLIP", "sharpness", "MAPE, lit",
    "(truth), lit", "relMSE, lit", "FLIP, lit", "bias, lit", "illuminance", "(absolute)", "UGR",
    "samples", "s", "MB", "peak MB", "precompute s",
)  # fmt: skip
NAMES = ("mape", "mape_of_reference", "relative_error", "hdr_flip")
BEST = ("MAPE", "relMSE", "FLIP", "illuminance", "bias", "(absolute)", "UGR")  # least is marked
Seconds = dict[tuple[str, str], float]  # by kind and lamp


@dataclass(frozen=True)
class Grid:
    """A table with its notes.

    Arguments:
        notes: reasons of dashes and of systems that failed.
    """

    head: tuple[str, ...]
    rows: list[list[str]]
    notes: list[str]

    def markdown(self) -> str:
        """As Markdown, notes below."""
        lines = ["| " + " | ".join(self.head) + " |", "|---" * len(self.head) + "|"]
        lines += ["| " + " | ".join(row) + " |" for row in self.rows]
        return "\n".join([*lines, "", *(f"- {note}" for note in self.notes)]).rstrip() + "\n"


def main(results: Results, systems: Sequence[System]) -> Grid:
    """Every lamp and system at the most samples that were measured."""
    return _grid(results, systems, None)


def equal_time(results: Results, systems: Sequence[System], seconds: Seconds) -> Grid:
    """The same for the seconds of a kind and lamp, between the pictures of a series."""
    return _grid(results, systems, seconds)


def common_seconds(results: Results) -> Seconds:
    """What our accurate mode takes for its last picture, or else the first system."""
    found: Seconds = {}
    for kind in KINDS:
        for lamp in results.lamps:
            steps = results.steps(lamp, OURS, kind)
            others = [s for n in results.systems if (s := results.steps(lamp, n, kind))]
            if steps or others:
                found[kind, lamp] = (steps or others[0])[-1].seconds
    return found


def _grid(results: Results, systems: Sequence[System], seconds: Seconds | None) -> Grid:
    known = {system.name: system for system in systems}
    notes: dict[str, None] = {}
    rows: list[list[str]] = []
    for lamp in results.lamps:
        cells = {}
        for name in results.systems:
            cells[name] = _row(results, lamp, name, seconds)
            for kind in ("appearance", "illumination"):
                if reason := _reason(results, lamp, name, known.get(name), kind):
                    notes[reason] = None
        rows += [[lamp, name, *row] for name, row in zip(cells, _marked(cells), strict=True)]
    for record in results.records:
        if record.failed and not record.system:
            notes[f"{record.lamp}: failed: {record.failed}"] = None
    return Grid(HEAD, rows, list(notes))


@dataclass(frozen=True)
class Cell:
    """A figure and how it is written."""

    value: float | None
    style: str = ".3g"

    def text(self, *, best: bool) -> str:
        """A dash where there is none, bold where it is the best."""
        if self.value is None:
            return "-"
        text = format(self.value, self.style)
        return f"**{text}**" if best else text


def _row(results: Results, lamp: str, name: str, seconds: Seconds | None) -> list[Cell]:
    looks, lit = (
        _step(results, lamp, name, kind, seconds) for kind in ("appearance", "illumination")
    )
    floors, glare = (
        [r for r in results.chosen(lamp, name, task, equal_time=seconds is not None) if r.figures]
        for task in (FLOOR, GLARE)
    )
    floor = floors[-1] if floors else None
    ugr = [abs(e) for r in glare if (e := r.figure("ugr_error")) is not None]
    memory = [r.memory for r in results.of(lamp, name, "room") if r.memory]
    cost, timed = results.cost(lamp, name), lit or looks
    return [
        *(_cell(looks, n) for n in (*NAMES, "sharpness")),
        *(_cell(lit, n) for n in NAMES),
        _cell(lit, "mean", "+.1%"),
        Cell(floor.figure("lux_error") if floor else None, "+.1%"),
        Cell(floor.figure("lux_absolute") if floor else None, ".1%"),
        Cell(sum(ugr) / len(ugr) if ugr else None, ".2f"),
        Cell(float(timed.samples) if timed else None, ".0f"),
        Cell(timed.seconds if timed else None, ".2f"),
        Cell(cost[1] if cost else None, ".2f"),
        Cell(max(memory) if memory else None, ".0f"),
        Cell(cost[0] if cost else None, ".0f"),
    ]


def _marked(rows: dict[str, list[Cell]]) -> list[list[str]]:
    """The cells as text, the least of each column of `BEST` marked where there are several."""
    least: list[float | None] = []
    for title, column in zip(HEAD[2:], zip(*rows.values(), strict=True), strict=True):
        known = [abs(c.value) for c in column if c.value is not None]
        judged = title.split(",")[0] in BEST and len(known) > 1
        least.append(min(known) if judged else None)
    return [
        [
            cell.text(best=cell.value is not None and abs(cell.value) == low)
            for cell, low in zip(row, least, strict=True)
        ]
        for row in rows.values()
    ]


def _step(
    results: Results, lamp: str, name: str, kind: str, seconds: Seconds | None
) -> Step | None:
    steps = results.steps(lamp, name, kind)
    if seconds is not None and (kind, lamp) in seconds:
        return at(steps, seconds[kind, lamp])
    return steps[-1] if steps else None


def _reason(results: Results, lamp: str, name: str, system: System | None, kind: str) -> str:
    """Why there is a dash, or nothing where there is none."""
    if system is not None and kind not in system.answers:
        return f"{name}: cannot show {kind}. {system.label}"
    failed = results.reason(lamp, name, PREFIXES[kind])
    if not failed and not any(results.of(lamp, name, prefix) for prefix in PREFIXES[kind]):
        return f"{lamp}, {name}: {kind} was not measured"
    return f"{lamp}, {name}: {kind} failed: {failed}" if failed else ""


def _cell(step: Step | None, name: str, style: str = ".3g") -> Cell:
    return Cell(step.figures.get(name) if step else None, style)
