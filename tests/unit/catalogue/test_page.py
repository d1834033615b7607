"""What a catalogue shows: the page, the index and the stage."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

from purelight_catalogue.catalogue import Card, gather
from purelight_catalogue.entries import Entry
from purelight_catalogue.index import write_index
from purelight_catalogue.jobs import Job
from purelight_catalogue.page import write_page
from purelight_catalogue.results import Results
from purelight_catalogue.usd_stage import write_stage
from purelight_catalogue.work import perform


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


def test_no_lamp_no_stage(tmp_path: Path) -> None:
    assert write_stage([], tmp_path) is None
