"""A catalogue: what became of each lamp, its files gathered under its name."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from purelight_catalogue.entries import Entry
from purelight_catalogue.jobs import NEEDED, Job
from purelight_catalogue.results import Results
from purelight_catalogue.work import Outcome
from purelight_format import atomic
from purelight_format.photometry.files import read_photometry
from purelight_format.photometry.polar_plot import polar_plot

GATHERED = {  # By stage, what a person may want
    "train": ("run/report.html",),
    "export": ("*.plux", "*.usda", "*.ies", "*.ldt"),
    "picture": ("picture.png",),
    "photometry": ("*.photons.json", "*.photons.ies", "truth.png"),
    "check": ("validate.json", "inspect.json"),
}
KINDS = {  # What files are by their suffixes; others by their names
    "plux": "plux", "usda": "usda", "ies": "ies", "ldt": "ldt", "photons.json": "photons",
    "photons.ies": "photons_ies", "shape.ies": "shape",
}  # fmt: skip


@dataclass(frozen=True)
class Card:
    """One lamp of a catalogue.

    Arguments:
        fault: one line on why it has no bundle; empty if it has.
        files: in its folder, by what they are.
        about: what `purelight-inspect --json` says.
        photons: figures of the light that was traced besides (`photons`); empty without.
        seconds: of all its jobs; gibibytes: the most memory one of them had.
        warnings: one line on each thing besides that it could not have.
    """

    entry: Entry
    fault: str
    files: Mapping[str, str]
    about: Mapping[str, Any]
    seconds: float
    gibibytes: float
    photons: Mapping[str, Any] = field(default_factory=dict)
    warnings: Sequence[str] = ()


def gather(
    entry: Entry, jobs: Sequence[Job], outcomes: Mapping[str, Outcome], results: Results,
    output: Path,
) -> Card:  # fmt: skip
    """Put a lamp's files into `output/lamps/NAME` and tell about it."""
    folder = output / "lamps" / entry.name
    faults, warnings = _told(jobs, outcomes)
    ended = [outcomes[job.key] for job in jobs if job.key in outcomes]
    files: dict[str, str] = {}
    for job in jobs:
        if results.done(job):
            files |= _copy(job, results.path(job.stage, job.key), folder)
    if "ies" in files:
        files["polar"] = _polar(output, files["ies"])
    about, photons = (
        _read(output / files[kind]) if kind in files else {} for kind in ("inspect", "photons")
    )
    return Card(
        entry, faults[0] if faults else "", files, about,
        round(sum(o.seconds for o in ended), 1), max((o.gibibytes for o in ended), default=0.0),
        photons, warnings,
    )  # fmt: skip


def _told(jobs: Sequence[Job], outcomes: Mapping[str, Outcome]) -> tuple[list[str], list[str]]:
    """What went wrong: with what a lamp needs, and, if that went well, with what it can do without.

    One line for each stage is enough, where many jobs are of one.
    """
    lines: dict[str, str] = {}
    for job in jobs:
        outcome = outcomes.get(job.key)
        if outcome and outcome.fault:
            lines.setdefault(job.stage, f"{job.stage}: {outcome.fault}")
    faults = [line for stage, line in lines.items() if stage in NEEDED]
    return faults, [] if faults else list(lines.values())


def _polar(output: Path, ies: str) -> str:
    """The polar diagram of an IES file, drawn beside it."""
    name = str(Path(ies).with_name("polar.svg").as_posix())
    drawn = polar_plot([read_photometry(output / ies)])
    atomic.write_bytes(output / name, drawn.encode())
    return name


def _copy(job: Job, source: Path, folder: Path) -> dict[str, str]:
    """Files of one result, linked where the disk can; by suffix or name."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for pattern in GATHERED.get(job.stage, ()):
        for path in sorted(source.glob(pattern)):
            target = folder / path.name
            _link(path, target)
            kind = KINDS.get("".join(path.suffixes)[1:], path.stem)
            found[kind] = f"lamps/{folder.name}/{path.name}"
    return found


def _link(source: Path, target: Path) -> None:
    """The same file under another name, or a copy where two names are not possible."""
    draft = target.with_name(f".{target.name}.tmp")
    draft.unlink(missing_ok=True)
    try:
        os.link(source, draft)
    except OSError:
        shutil.copyfile(source, draft)
    os.replace(draft, target)


def _read(path: Path) -> dict[str, Any]:
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
