"""Keys of jobs: what changes them, and what does not."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import pytest

from purelight_catalogue.entries import Entry
from purelight_catalogue.inputs import input_digest
from purelight_catalogue.jobs import Settings, jobs_of
from purelight_format.errors import PureLightError


def keys(entry: Entry, settings: Settings = Settings()) -> dict[str, str]:  # noqa: B008
    return {job.stage: job.key for job in jobs_of(entry, settings)}


def test_only_what_depends_on_a_change_gets_a_new_key(entries: list[Entry]) -> None:
    entry = entries[0]
    before = keys(entry)
    assert keys(entry) == before
    brighter = keys(replace(entry, lumens=806.0))
    assert brighter["train"] == before["train"]
    assert brighter["export"] != before["export"]
    assert brighter["check"] != before["check"]
    larger = keys(entry, Settings(picture=512))
    assert [s for s in before if larger[s] != before[s]] == ["picture"]
    other = keys(entry, Settings(preset="standard"))
    assert all(other[stage] != before[stage] for stage in before)


def test_a_target_error_adds_a_stage(entries: list[Entry]) -> None:
    jobs = jobs_of(entries[0], Settings(target_error=0.05))
    assert [job.stage for job in jobs] == ["train", "size", "export", "check", "picture"]
    assert jobs[2].before == {"run": jobs[1].key}


def test_the_same_lamp_elsewhere_has_the_same_keys(entries: list[Entry], tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere/desk.xml"
    moved.parent.mkdir()
    shutil.copyfile(entries[0].file, moved)
    assert keys(replace(entries[0], file=moved))["train"] == keys(entries[0])["train"]


def test_what_a_lamp_names_is_part_of_it(tmp_path: Path) -> None:
    lamp, mesh = tmp_path / "lamp.obj", tmp_path / "meshes/wood.png"
    mesh.parent.mkdir()
    lamp.write_text("mtllib lamp.mtl")
    (tmp_path / "lamp.mtl").write_text("map_Kd meshes/wood.png")
    mesh.write_bytes(b"1")
    (tmp_path / "other.png").write_bytes(b"1")
    first = input_digest(lamp)
    (tmp_path / "other.png").write_bytes(b"2")
    assert input_digest(lamp) == first
    mesh.write_bytes(b"2")
    assert input_digest(lamp) != first


def test_a_lamp_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="no such file"):
        jobs_of(Entry("x", tmp_path / "x.xml"), Settings())
