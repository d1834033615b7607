"""A preset's cost from a share of its steps."""

from __future__ import annotations

import argparse
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.preset_cost import part_of, stages, table
from purelight_train.presets import PAPER, PRESETS

SECONDS = {"light": 10.0, "student": 30.0, "pilot": 4.0, "sampler": 6.0}
STEPPED = {"student": 20.0, "pilot": 4.0, "sampler": 6.0}


@pytest.mark.parametrize("name", PRESETS)
def test_a_part_differs_in_steps_alone(name: str) -> None:
    whole, part = PRESETS[name], part_of(PRESETS[name], 0.01)
    assert part.photons.steps == max(1, round(0.01 * whole.photons.steps))
    assert part.photons.batch == whole.photons.batch
    assert part.student_network == whole.student_network
    assert part_of(whole, 1.0) == whole


@pytest.mark.parametrize(("route", "steps"), [("photons", 500), ("teacher", 1000)])
def test_steps_are_extrapolated_and_the_rest_is_whole(route: str, steps: int) -> None:
    def read_json(name: str) -> dict[str, float]:
        return {"step_seconds": STEPPED[name.removeprefix("networks/").removesuffix(".json")]}

    made: Any = SimpleNamespace(run=SimpleNamespace(read_json=read_json))
    rows = stages(made, SECONDS, PAPER, argparse.Namespace(share=0.01, route=route))
    found = {row["stage"]: row for row in rows}
    assert found["light"]["whole_hours"] == 10 / 3600
    assert found["student"]["steps"] == steps
    assert found["student"]["step_milliseconds"] == pytest.approx(20_000 / steps)
    assert found["student"]["whole_hours"] == pytest.approx((100 * 20 + 10) / 3600)
    assert found["pilot"]["steps"] == found["sampler"]["steps"] == 500
    last = table({"device": "a card", "share": 0.01, "stages": rows}).splitlines()[-1]
    assert last.startswith("| all | 50.0 |")
