"""Which lamps a folder or a table holds."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_catalogue.entries import file_name, read_entries
from purelight_format.errors import PureLightError


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("")


def test_a_folder_holds_files_and_folders_of_lamps(tmp_path: Path) -> None:
    names = ("Globe.xml", "desk/scene.glb", "notes.txt", "desk/wood.png", "pair/one.obj",
             "pair/two.obj")  # fmt: skip
    touch(*(tmp_path / name for name in names))
    found = [entry.name for entry in read_entries(tmp_path)]
    assert found == ["desk", "globe", "pair-one", "pair-two"]


def test_names_that_would_be_one_are_told_apart(tmp_path: Path) -> None:
    touch(tmp_path / "a b.xml", tmp_path / "a_b.xml", tmp_path / "a-b-2.xml")
    names = [entry.name for entry in read_entries(tmp_path)]
    assert len(set(names)) == 3
    assert "a-b-2" in names


def test_a_table_says_what_each_lamp_is_asked(tmp_path: Path) -> None:
    table = tmp_path / "lamps.csv"
    table.write_text("﻿file,name,lumens,emitter,preset\nx.glb,Big Lamp,806,bulb=1;led=2,standard\n"
                     "y.xml,,,,\n", encoding="utf-8")  # fmt: skip
    big, plain = read_entries(table)
    assert (big.name, big.lumens, big.file) == ("big-lamp", 806.0, tmp_path / "x.glb")
    assert big.options == {"preset": ("standard",), "emitter": ("bulb=1", "led=2")}
    assert plain.name == "y"
    assert plain.options == {}


def test_lines_of_json_hold_lists(tmp_path: Path) -> None:
    table = tmp_path / "lamps.jsonl"
    table.write_text('{"file": "x.glb", "omit": ["floor", "a;b"], "target_error": 0.05}\n\n')
    (entry,) = read_entries(table)
    assert entry.options == {"omit": ("floor", "a;b")}
    assert entry.target_error == 0.05


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("file,colour\nx.xml,red\n", "no column 'colour'"),
        ("name\nx\n", "has no 'file'"),
        ("file,lumens\nx.xml,bright\n", "lumens must be a number above zero"),
        ("file,lumens\nx.xml,nan\n", "lumens must be a number above zero"),
        ("file\nx.xml,too,many\n", "not a row"),
        ("file\n", "holds no lamp"),
    ],
)
def test_a_faulty_table_is_one_line(tmp_path: Path, text: str, reason: str) -> None:
    table = tmp_path / "lamps.csv"
    table.write_text(text)
    with pytest.raises(PureLightError, match=reason):
        read_entries(table)


@pytest.mark.parametrize(
    "text",
    ["[1]\n", "{\n", '{"file": 1}\n{"file"', "[" * 200_000, '{"file": "a.xml", "seed": [1, 2]}'],
)
def test_faulty_json_is_one_line(tmp_path: Path, text: str) -> None:
    table = tmp_path / "lamps.jsonl"
    table.write_text(text)
    with pytest.raises(PureLightError):
        read_entries(table)


def test_a_line_ends_where_a_line_of_json_does(tmp_path: Path) -> None:
    table = tmp_path / "lamps.jsonl"
    table.write_text('{"file": "a.xml", "name": "one\u2028two"}\n', encoding="utf-8")
    assert [entry.name for entry in read_entries(table)] == ["one-two"]


def test_a_folder_without_lamps(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="holds no lamp"):
        read_entries(tmp_path)


@pytest.mark.parametrize("text", ["../../etc", "CON", "ä" * 300, "", "<script>", "x" * 300])
def test_names_are_safe_for_files_and_pages(text: str) -> None:
    name = file_name(text)
    assert name
    assert len(name) <= 64
    assert set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789-")
