"""What a catalogue shows: the page, the index and the stage."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

import pytest

from purelight_catalogue import cli
from purelight_catalogue.catalogue import Card, gather
from purelight_catalogue.entries import Entry
from purelight_catalogue.index import write_index
from purelight_catalogue.jobs import Job, Settings, jobs_of
from purelight_catalogue.page import write_page
from purelight_catalogue.results import Results
from purelight_catalogue.usd_stage import write_stage
from purelight_catalogue.work import Outcome, perform
from tests.unit.catalogue.conftest import BEGUN, pretend


class Tags(HTMLParser):
    """Elements of a page that must balance, and the links in it."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "input", "img"):
            self.open.append(tag)
        self.links += [value for key, value in attrs if key in ("href", "src") and value]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def cards_of(
    exported: tuple[Results, dict[str, list[Job]]], entries: list[Entry], output: Path
) -> list[Card]:
    results, work = exported
    outcomes = {}
    for jobs in work.values():
        for job in jobs:
            outcomes[job.key] = perform(job, results.folder, output / "logs", 1, [])
            assert not outcomes[job.key].fault
    return [gather(entry, work[entry.name], outcomes, results, output) for entry in entries]


def test_everything_that_is_shown_is_there(
    exported: tuple[Results, dict[str, list[Job]]], entries: list[Entry], tmp_path: Path
) -> None:
    output = tmp_path / "catalogue"
    cards = cards_of(exported, entries, output)
    bad = Entry("<b>bad", Path("lamps/<script>.xml"))
    cards.append(Card(bad, 'train: "<img src=x onerror=alert(1)>"', {}, {}, 0.0, 0.0))
    page, index = write_page(cards, output), write_index(cards, output)
    tags, text = Tags(), page.read_text()
    tags.feed(text)
    assert not tags.open
    assert "<img src=x" not in text
    assert "<b>bad" not in text
    assert tags.links
    assert all((output / link).is_file() for link in tags.links)
    data = json.loads(index.read_text())
    assert [lamp["name"] for lamp in data["lamps"]] == ["desk", "globe", "wall"]
    assert data["failed"][0]["fault"].startswith("train")
    assert all((output / f).is_file() for lamp in data["lamps"] for f in lamp["files"].values())


def test_the_stage_has_every_lamp_and_one_that_is_any_of_them(
    exported: tuple[Results, dict[str, list[Job]]], entries: list[Entry], tmp_path: Path
) -> None:
    from pxr import Usd

    output = tmp_path / "catalogue"
    path = write_stage(cards_of(exported, entries, output), output)
    assert path is not None
    stage = Usd.Stage.Open(str(path))
    placed = stage.GetPrimAtPath("/Catalogue").GetChildren()
    assert [p.GetName() for p in placed] == ["lamp_desk", "lamp_globe", "lamp_wall"]
    variants = stage.GetPrimAtPath("/Lamp").GetVariantSet("lamp")
    assert variants.GetVariantNames() == ["lamp_desk", "lamp_globe", "lamp_wall"]
    layers = {Path(layer.realPath).name for layer in stage.GetUsedLayers()}
    assert {"desk.usda", "globe.usda", "wall.usda"} <= layers


@pytest.mark.parametrize(("stage", "failed"), [("photons", 0), ("picture", 0), ("check", 1)])
def test_only_what_a_lamp_needs_is_its_fault(
    entries: list[Entry], tmp_path: Path, stage: str, failed: int,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    results, entry = Results(tmp_path / "results"), entries[0]
    outcomes, jobs = {}, jobs_of(entry, Settings(picture=16, photons=1))
    for job in jobs:
        outcomes[job.key] = Outcome(job, "<it> is dark" if job.stage == stage else "")
        if job.stage in BEGUN:
            pretend(results, job, entry.name)
        if job.stage == "check" != stage:
            perform(job, results.folder, tmp_path / "logs", 1, [])
    card = gather(entry, jobs, outcomes, results, tmp_path / "catalogue")
    assert cli._write([card], tmp_path / "catalogue") == failed
    assert f"{stage}: <it> is dark" in capsys.readouterr().err
    data = json.loads((tmp_path / "catalogue/catalogue.json").read_text())
    assert len(data["failed"]) == failed
    assert [one["warnings"] for one in data["lamps"]] == [[f"{stage}: <it> is dark"]][failed:]
    assert f"{stage}: &lt;it&gt; is dark" in (tmp_path / "catalogue/index.html").read_text()


def test_no_lamp_no_stage(tmp_path: Path) -> None:
    assert write_stage([], tmp_path) is None
