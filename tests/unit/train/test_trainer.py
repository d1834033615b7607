"""Declared networks: stages, random numbers, and what is gathered once."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import torch

from purelight_format.errors import PureLightError
from purelight_train.runs.run_directory import RunDirectory
from purelight_train.runs.stages import Stages, number

NUMBERS = {
    "light": 0, "teacher": 1, "distillation": 2, "student": 3, "transparency": 4, "cap": 5,
    "pilot": 6, "aim": 7, "sampler": 8, "fast_map": 9, "metrics": 10,
}  # fmt: skip


def test_stages_keep_their_random_numbers(tmp_path: Path) -> None:
    """Other numbers, and the same run would become another lamp."""
    assert {stage: number(stage) for stage in NUMBERS} == NUMBERS
    stages = Stages(RunDirectory(tmp_path), 3, torch.device("cpu"), ("light",))
    for stage, key in NUMBERS.items():
        expected = np.random.default_rng([3, key, 2]).random()
        assert stages.rng(stage, 2).random() == expected
    names = [f"network {k}" for k in range(100)]
    assert len({*map(number, names), *NUMBERS.values()}) == 100 + len(NUMBERS)


@pytest.mark.usefixtures("mitsuba")
def test_stages_of_a_run_are_those_of_its_networks() -> None:
    from purelight_train.runs.pipeline import stage_names

    ours = ("student", "transparency", "cap", "pilot", "aim", "sampler", "fast_map")
    assert stage_names("photons")[:8] == ("light", *ours)
    assert stage_names("photons", {"verdict", "cap"}) == (
        "light", "student", "transparency", "pilot", "aim", "sampler", "fast_map"
    )  # fmt: skip
    assert stage_names("teacher")[:10] == ("light", "teacher", "distillation", *ours)


@pytest.mark.usefixtures("mitsuba")
def test_data_are_gathered_once() -> None:
    from purelight_train.runs.trainer import Trainer

    calls: list[str] = []

    def gather(trainer: Trainer) -> list[str]:
        calls.append("gathered")
        return calls

    trainer, other = (Trainer(cast(Any, None)) for _ in range(2))
    assert trainer.data(gather) is trainer.data(gather) is calls
    assert len(calls) == 1
    other.data(gather)
    assert len(calls) == 2


def test_a_run_is_finished_when_every_network_it_names_is(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    run.write_json("config.json", {})
    run.save("student", torch.nn.Linear(1, 1), {})
    with pytest.raises(PureLightError, match="has not finished"):
        RunDirectory.open(tmp_path)
    run.write_json("metrics.json", {"losses": {"student": [1.0], "fast_map": [2.0]}})
    with pytest.raises(PureLightError, match="has not finished"):
        RunDirectory.open(tmp_path)
    run.save("fast_map", torch.nn.Linear(1, 1), {})
    assert RunDirectory.open(tmp_path).path == tmp_path
