"""A catalogue's parts: lamps whose bundles are there already, so that no test trains one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from purelight_catalogue.entries import Entry
from purelight_catalogue.jobs import Job, Settings, jobs_of
from purelight_catalogue.results import Results

EXAMPLE = Path(__file__).parents[3] / "spec/example.plux"
BEGUN = ("train", "export")  # stages that `exported` pretends to have done


@pytest.fixture
def entries(tmp_path: Path) -> list[Entry]:
    """Three lamps that differ."""
    found = []
    for name in ("desk", "globe", "wall"):
        file = tmp_path / "lamps" / f"{name}.xml"
        file.parent.mkdir(exist_ok=True)
        file.write_text(f"<scene version='3.0.0'><!-- {name} --></scene>")
        found.append(Entry(name, file))
    return found


@pytest.fixture
def exported(tmp_path: Path, entries: list[Entry]) -> tuple[Results, dict[str, list[Job]]]:
    """Results in which the lamps are exported, and all jobs of each."""
    results = Results(tmp_path / "results")
    work = {entry.name: jobs_of(entry, Settings(picture=16)) for entry in entries}
    for name, jobs in work.items():
        for job in jobs:
            if job.stage in BEGUN:
                pretend(results, job, name)
    return results, work


def pretend(results: Results, job: Job, name: str) -> None:
    """A job's result, of the format's example."""
    with results.attempt(job) as draft:
        if job.stage == "export":
            shutil.copyfile(EXAMPLE, draft / f"{name}.plux")
            (draft / f"{name}.usda").write_text(
                '#usda 1.0\n(\n    defaultPrim = "L"\n)\ndef "L" {}\n'
            )
        results.keep(draft, job, 2.0, 0.5)
