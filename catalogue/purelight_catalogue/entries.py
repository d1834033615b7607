"""The lamps of a catalogue: the files in a folder, or the rows of a table."""

from __future__ import annotations

import csv
import io
import json
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS

# What `purelight-train` takes; a folder's other files are meshes, textures and whatever else
LAMPS = (".xml", ".glb", ".gltf", ".obj", ".usd", ".usda", ".usdc", ".usdz", ".tm25ray")
TABLES = (".csv", ".jsonl")
LARGEST_TABLE = 64 << 20  # bytes
# Columns that are options of `purelight-train`; those of PLURAL may be said more than once
PLURAL = ("emitter", "pieces", "omit", "keep", "glass")
OPTIONS = ("preset", "seed", "route", "anchor", "units", "up", "kelvin", *PLURAL)
SCENE = ("units", "up", "kelvin", *PLURAL)  # Those that say what the lamp is, not how to learn it
OWN = ("file", "name", "lumens", "target_error")


@dataclass(frozen=True)
class Entry:
    """One lamp, and what is asked for it alone.

    Arguments:
        name: of its files and its card, unlike any other's.
        file: what `purelight-train` takes.
        options: of `purelight-train`, in the order of `OPTIONS`; values as on a command line.
        lumens: to scale its light to.
        target_error: for the smallest networks that reach it.
    """

    name: str
    file: Path
    options: Mapping[str, Sequence[str]] = field(default_factory=dict)
    lumens: float | None = None
    target_error: float | None = None


def read_entries(source: Path) -> list[Entry]:
    """The lamps of a folder or a table, by name.

    Raises:
        PureLightError: there is none, or the table says something that is not known.
    """
    if source.is_dir():
        found = list(_of_folder(source))
    elif source.suffix.lower() in TABLES:
        found = [_of_row(row, number, source) for number, row in enumerate(_rows(source), 1)]
    else:
        raise PureLightError(
            f"{source}: give a folder of lamps, or a table of them ({' or '.join(TABLES)})"
        )
    if not found:
        raise PureLightError(f"{source}: holds no lamp; lamps end in {' '.join(LAMPS)}")
    return _tell_apart(sorted(found, key=lambda entry: (entry.name, str(entry.file))))


def file_name(text: str) -> str:
    """A name for files in any system, in a bundle and in a page's address."""
    word = re.sub(r"[^a-z0-9]+", "-", text.lower()).strip("-")
    return word[: LIMITS.name_part_bytes - 16].strip("-") or "lamp"


def _of_folder(folder: Path) -> Iterator[Entry]:
    """Lamps lie in the folder, or one in a folder of its own: `desk/scene.xml` is named `desk`."""
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.suffix.lower() in LAMPS:
            yield Entry(file_name(path.stem), path)
        elif path.is_dir() and not path.name.startswith("."):
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() in LAMPS)
            for lamp in inside:
                alone = len(inside) == 1
                yield Entry(file_name(path.name if alone else f"{path.name} {lamp.stem}"), lamp)


def _rows(table: Path) -> Iterator[dict[str, Any]]:
    if not table.is_file() or table.stat().st_size > LARGEST_TABLE:
        raise PureLightError(f"{table}: no such table, or one over {LARGEST_TABLE >> 20} MiB")
    try:
        text = table.read_text(encoding="utf-8-sig")
        if table.suffix.lower() == ".csv":
            yield from csv.DictReader(io.StringIO(text), strict=True)
        else:
            yield from (json.loads(line) for line in text.split("\n") if line.strip())
    except (ValueError, RecursionError, csv.Error) as error:
        raise PureLightError(f"{table}: not a table: {error}") from None


def _of_row(row: Any, number: int, table: Path) -> Entry:
    where = f"{table}, lamp {number}"
    if not isinstance(row, dict) or None in row:
        raise PureLightError(f"{where}: not a row of named columns")
    known = {key: value for key, value in row.items() if value not in (None, "", [])}
    unknown = next((key for key in known if key not in OPTIONS + OWN), None)
    if unknown is not None:
        columns = " ".join(OWN + OPTIONS)
        raise PureLightError(f"{where}: no column '{unknown}'; the columns are {columns}")
    if "file" not in known:
        raise PureLightError(f"{where}: has no 'file'")
    file = table.parent / str(known["file"])
    options = {key: _words(key, known[key], where) for key in OPTIONS if key in known}
    return Entry(
        file_name(str(known.get("name", file.stem))), file, options,
        _number(known, "lumens", where), _number(known, "target_error", where),
    )  # fmt: skip


def _words(key: str, value: Any, where: str) -> tuple[str, ...]:
    """Values of an option; in CSV, those that may be many are parted by semicolons."""
    if isinstance(value, list):
        if len(value) > 1 and key not in PLURAL:
            raise PureLightError(f"{where}: {key} takes one value, not {len(value)}")
        return tuple(map(str, value))
    return tuple(filter(None, str(value).split(";"))) if key in PLURAL else (str(value),)


def _number(row: Mapping[str, Any], key: str, where: str) -> float | None:
    if key not in row:
        return None
    try:
        value = float(row[key])
    except (TypeError, ValueError):
        value = 0.0
    if not 0 < value < 1e12:
        raise PureLightError(f"{where}: {key} must be a number above zero")
    return value


def _tell_apart(entries: Sequence[Entry]) -> list[Entry]:
    """Numbers behind names that are taken."""
    taken, seen = {entry.name for entry in entries}, Counter[str]()
    result = []
    for entry in entries:
        seen[entry.name] += 1
        name, number = entry.name, seen[entry.name]
        while number > 1 and name in taken:
            name, number = f"{entry.name}-{number}", number + 1
        taken.add(name)
        result.append(replace(entry, name=name))
    return result
