"""A preset of a system's own: trained once for both modes, anew where lamp or preset changed."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.systems import subjects
from benchmarks.systems.own.purelight import TRAINING
from benchmarks.systems.own.trained_by import TrainedBy
from benchmarks.systems.protocol import Subject
from benchmarks.systems.runner import Runner
from benchmarks.systems.scales import scale
from benchmarks.systems.subjects import Facts


@pytest.fixture
def lamp(tmp_path: Path) -> Subject:
    """What `subjects.subject` leaves, as far as it is asked here."""
    (tmp_path / "lamp.json").write_text(json.dumps({"key": "lamp"}))
    (tmp_path / "systems").mkdir()
    zero = (0.0, 0.0, 0.0)
    return Subject(
        "ball", tmp_path / "lamp.xml", tmp_path / "run", tmp_path / "lamp.plux", zero, 1.0, zero, 1
    )


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Presets in the order in which they were trained; nothing is."""
    done: list[str] = []

    def make(scene: Path, folder: Path, preset: str, threads: int, key: str) -> Iterator[None]:
        done.append(preset)
        (folder / TRAINING).write_text(json.dumps({"training": 3.0, "export": 1.0}))
        (folder / "lamp.plux").write_bytes(bytes(1000))
        (folder / "lamp.json").write_text(json.dumps({"key": key}))
        yield None

    monkeypatch.setattr(subjects, "make", make)
    return done


def prepare(system: TrainedBy, lamp: Subject) -> float:
    folder = lamp.bundle.parent / "systems" / system.name
    folder.mkdir(exist_ok=True)
    return system.prepare(lamp, folder).seconds


@pytest.mark.parametrize("modes", [("accurate", "fast"), ("fast", "accurate")])
def test_modes_share_a_training(modes: tuple[str, str], lamp: Subject, trained: list[str]) -> None:
    assert [prepare(TrainedBy("draft", mode), lamp) for mode in modes] == [4.0, 4.0]
    assert trained == ["draft"]


def test_a_changed_lamp_or_preset_is_trained_anew(
    lamp: Subject, trained: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    system = TrainedBy("draft")
    runner = Runner(lamp.bundle.parent, scale("smoke"), [system])
    (task,) = (t for t in scale("smoke").tasks("crystal", 0.1) if t.name == "room")
    keys = [runner.key(Facts(lamp, "facts", 0.1), system, task)]
    prepare(system, lamp)
    lamp.bundle.with_name("lamp.json").write_text(json.dumps({"key": "another"}))
    prepare(system, lamp)
    other = replace(subjects.ALL_PRESETS["draft"], paths=7)
    monkeypatch.setitem(subjects.ALL_PRESETS, "draft", other)
    prepare(system, lamp)
    prepare(system, lamp)
    assert trained == ["draft"] * 3
    keys.append(runner.key(Facts(lamp, "facts", 0.1), system, task))
    assert len(set(keys)) == 2
