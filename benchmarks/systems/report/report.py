"""The report of a folder of records: CSV, Markdown, PNG, and one HTML page that holds them all."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.systems.protocol import System
from benchmarks.systems.records import Record, Records
from benchmarks.systems.report import claims, drawing, published, tables
from benchmarks.systems.report.rows import rows
from benchmarks.systems.report.series import Results
from benchmarks.systems.report.tables import Grid
from benchmarks.systems.scales import SCALES
from purelight_format import atomic
from purelight_format.errors import PureLightError
from purelight_train.report.page import Row, Section, Shot, Table, Warnings, write_page

LEAD = (
    "Every system draws the same pictures of the same lamps, and is judged by them beside a "
    "light-traced truth. Appearance: views of the lamp itself; lit: a closed room. A series of "
    "samples ends at the scale's limit of seconds; the least error of a lamp has a star, whosever "
    "it is."
)
EQUAL = "At equal time: each system's last picture in the time of our accurate mode's."
REMARKS = {
    "tiny": "tries the machinery alone: errors of what was trained say nothing of our lamps",
    "sketch": "is a first look at a lamp: light about right, pictures soft",
}
LIMIT = 1 << 20  # bytes of a published file
COSTS = tables.HEAD.index("samples")  # the first column that is no error


def write(folder: Path, systems: Sequence[System], publish: Path | None) -> str:
    """Write the report into FOLDER/report, and where it is published; returns the tables.

    Lamps that were published before and that the folder has no records of stay published.

    Raises:
        PureLightError: there are no records, or what was published cannot be read.
    """
    records = Records(folder).current()
    if not any(r.system or r.failed for r in records):
        raise PureLightError(f"{folder}: no records yet; measure first, without --report")
    report = _report(folder, records, systems)
    _save(folder / "report", report)
    if publish is not None:
        _publish(publish, folder, records, report)
    return report.text


@dataclass(frozen=True)
class _Report:
    results: Results
    systems: Sequence[System]
    remark: str
    text: str
    files: dict[str, bytes]


def _report(folder: Path, records: Sequence[Record], systems: Sequence[System]) -> _Report:
    places = {system.name: k for k, system in enumerate(systems)}
    records = sorted(records, key=lambda r: (places.get(r.system, len(places)), r.lamp))
    results = Results(records)
    remark = f"{_remark(folder.name)} {_circumstances(records)}".strip()
    text, files = f"{remark}\n\n{_text(results, systems)}".lstrip(), _figures(folder, results)
    files |= {"results.md": text.encode(), **_values(results)}
    return _Report(results, systems, remark, text, files)


def _publish(target: Path, folder: Path, records: Sequence[Record], report: _Report) -> None:
    """Publish a folder's report, with the lamps that are published and that it does not hold."""
    if kept := published.records(target, {r.lamp for r in records}):
        report = _report(folder, [*records, *kept], report.systems)
    older = {r.lamp for r in kept}
    for path in target.glob("*.png"):  # rows are of pictures that are not here
        if _owner(path.name, report.results.lamps) in older:
            report.files.setdefault(path.name, path.read_bytes())
    _check(report.files)
    _save(target, report)
    if (target / "index.html").stat().st_size > LIMIT:  # then its pictures lie beside it
        _page(target / "index.html", report, embedded=False)


def _remark(scale: str) -> str:
    """By which preset a scale's lamps were trained, and what that means; empty if unknown."""
    if scale not in SCALES:
        return ""
    preset = SCALES[scale].preset
    what = f", which {REMARKS[preset]}" if preset in REMARKS else ""
    return f"Lamps were trained by the preset {preset}{what}."


def _circumstances(records: Sequence[Record]) -> str:
    """Threads that systems had, and whether all are those of one code; empty where not told."""
    measured = [r for r in records if r.system]
    threads = sorted({r.threads for r in measured if r.threads})
    codes = {r.code for r in measured if r.code}
    said = []
    if len(threads) == 1:
        said.append(f"Systems had {threads[0]} thread{'s' * (threads[0] > 1)}.")
    elif threads:
        numbers = ", ".join(str(n) for n in threads)
        said.append(
            f"Systems had different numbers of threads ({numbers}): seconds do not compare."
        )
    if len(codes) > 1:
        lamps = {c: sorted({r.lamp for r in measured if r.code == c}) for c in codes}
        by = "; ".join(f"{code} ({', '.join(lamps[code])})" for code in sorted(codes))
        said.append(f"Series were measured by {len(codes)} versions of the code: {by}.")
    return " ".join(said)


def _save(target: Path, report: _Report) -> None:
    target.mkdir(parents=True, exist_ok=True)
    for name, data in report.files.items():
        atomic.write_bytes(target / name, data)
    for old in (*target.glob("*.png"), *target.glob("series_*.csv")):  # of what is there no more
        if old.name not in report.files:
            old.unlink()
    _page(target / "index.html", report, embedded=True)


def _check(files: dict[str, bytes]) -> None:
    """Raises PureLightError if a file is too large to be published."""
    large = [name for name, data in files.items() if len(data) > LIMIT]
    if large:
        raise PureLightError(
            f"{large[0]}: over {LIMIT >> 20} MiB; publish fewer lamps or a smaller scale"
        )


def _figures(folder: Path, results: Results) -> dict[str, bytes]:
    drawn = drawing.fronts(results) | drawing.roughness(results) | drawing.memory(results)
    return {f"{name}.png": data for name, data in {**drawn, **rows(folder, results)}.items()}


def _values(results: Results) -> dict[str, bytes]:
    """The last picture of each series, and by lamp all of them."""
    last = list({r.series: r for r in results.records}.values())
    made = {"results": last}
    for lamp in results.lamps:
        made[f"series_{lamp}"] = [r for r in results.records if r.lamp == lamp]
    return {f"{name}.csv": published.to_csv(rows).encode() for name, rows in made.items()}


def _grids(results: Results, systems: Sequence[System]) -> dict[str, Grid]:
    seconds = tables.common_seconds(results)
    return {
        "At the most samples that the limit of seconds allows": tables.main(results, systems),
        "At equal time (our accurate mode's last picture)": tables.equal_time(
            results, systems, seconds
        ),
    }


def _text(results: Results, systems: Sequence[System]) -> str:
    parts = [f"## {title}\n\n{g.markdown()}" for title, g in _grids(results, systems).items()]
    lines = ["## What the paper claims\n"]
    for verdict in claims.verdicts(results):
        lines.append(f"- **{verdict.word}**: {verdict.claim.text} ({verdict.claim.test}).")
        lines += [f"    - {lamp}: {figures}" for lamp, figures in verdict.figures.items()]
    parts.append("\n".join(lines) + "\n")
    named = [f"- `{s.name}`: {s.label}" for s in systems if s.name in results.systems]
    parts.append("\n".join(["## Systems\n", *named]) + "\n")
    return "\n".join(parts)


def _page(path: Path, report: _Report, *, embedded: bool) -> None:
    results, systems, files = report.results, report.systems, report.files
    sections: list[Section] = []
    failed = [r for r in results.records if r.failed]
    sections.append(Warnings([f"{r.lamp} {r.system} {r.task}: {r.failed}" for r in failed]))
    judged = [
        [v.claim.text, v.word, v.claim.test, "; ".join(f"{k}: {t}" for k, t in v.figures.items())]
        for v in claims.verdicts(results)
    ]
    sections.append(Table("What the paper claims", ("claim", "verdict", "test", "figures"), judged))
    for title, grid in _grids(results, systems).items():
        sections += _tables(title, grid)
    labels = [[s.name, s.label] for s in systems if s.name in results.systems]
    sections.append(Table("Systems", ("name", "what it is"), labels))
    for lamp in results.lamps:
        mine = {
            n: d
            for n, d in files.items()
            if n.endswith(".png") and _owner(n, results.lamps) == lamp
        }
        sections += _lamp(lamp, {n: d if embedded else None for n, d in mine.items()})
    write_page(path, "Systems side by side", f"{LEAD} {report.remark}".strip(), sections)


def _tables(title: str, grid: Grid) -> list[Section]:
    """A grid as one table of errors and one of costs, with its notes; a star is the least."""
    rows = [
        [f"{c.strip('*')}\u00a0*" if c.startswith("**") else c for c in row] for row in grid.rows
    ]
    made: list[Section] = []
    for part, columns in (("errors", slice(2, COSTS)), ("cost", slice(COSTS, None))):
        cells = [[*row[:2], *row[columns]] for row in rows]
        made.append(Table(f"{title}: {part}", [*grid.head[:2], *grid.head[columns]], cells))
    if grid.notes:
        made.append(Table("Why there is a dash", ("reason",), [[note] for note in grid.notes]))
    return made


def _owner(name: str, lamps: Sequence[str]) -> str:
    """The lamp that a picture is of: the longest name that it holds."""
    held = [lamp for lamp in lamps if f"_{lamp}_" in name.replace(".png", "_")]
    return max(held, key=len, default="")


def _lamp(lamp: str, mine: dict[str, bytes | None]) -> list[Section]:
    """Rows of pictures, then figures two by two; pictures without bytes lie beside the page."""
    shots = {name: _shot(name, data) for name, data in mine.items()}
    wide = [name for name in shots if name.startswith("row_")]
    small = [shot for name, shot in shots.items() if name not in wide]
    made: list[Section] = []
    for name in wide:
        task = name.removeprefix(f"row_{lamp}_").removesuffix(".png")
        made.append(Row(f"{lamp}: {task}", EQUAL, [shots[name]]))
    for k in range(0, len(small), 2):
        made.append(Row(f"{lamp}: figures", "", small[k : k + 2]))
    return made


def _shot(name: str, data: bytes | None) -> Shot:
    """A picture in the page, or by the name of its file."""
    title = name.removesuffix(".png").replace("_", " ")
    if data is None:
        return Shot(title, name)
    return Shot(title, "data:image/png;base64," + base64.b64encode(data).decode())
