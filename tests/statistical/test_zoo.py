"""Three lamps of the zoo, tiny, through every stage; minutes, so marked slow.

What so little training gives says nothing of the lamps. What the stages measure it with does: our
light tracer against Mitsuba's own integrators, and the enlarged lamp against the one of its own
size.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from benchmarks.zoo.__main__ import report
from benchmarks.zoo.columns import COLUMNS
from benchmarks.zoo.record import STAGES, Record

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
SEED, LAMPS = 1, (2, 16, 19)


@pytest.fixture(scope="module")
def zoo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("zoo")
    words = ["--output", str(output), "--seed", str(SEED), "--preset", "tiny", "--jobs", "2"]
    subprocess.run(
        [sys.executable, "-m", "benchmarks.zoo", *words, "--only", *map(str, LAMPS)],
        check=True, cwd=ROOT,
    )  # fmt: skip
    return output / str(SEED)


def records(zoo: Path) -> dict[str, Record]:
    return {path.parent.name: Record.open(path.parent) for path in zoo.glob("*/figures.json")}


def test_every_stage_ends_well(zoo: Path) -> None:
    found = records(zoo)
    assert len(found) == len(LAMPS)
    for name, record in found.items():
        troubles = {k: v for k, v in record.stages.items() if "figures" not in v}
        assert troubles == {}, name
        assert set(record.stages) == set(STAGES), name
        assert (zoo / name / "lamp.plux").is_file()
        for picture in ("portrait", "appearance", "transmittance"):
            assert (zoo / name / f"{picture}.png").is_file()


def test_figures_are_numbers(zoo: Path) -> None:
    always = {"flux", "floor", "(abs)", "floor, fast", "own size", "far field", "T", "T (abs)",
              "MAPE", "ESS", "map bias", "variance, fast", "s, all", "MB"}  # fmt: skip
    for name, record in records(zoo).items():
        known = {c.title for c in COLUMNS if c.value(record) is not None}
        assert always <= known, name


def test_our_tracer_agrees_with_mitsuba(zoo: Path) -> None:
    """Floors by our light tracer and by Mitsuba's integrators, within four deviations."""
    column = {c.title: c for c in COLUMNS}
    compared = 0
    for name, record in records(zoo).items():
        apart = column["tracer, Mitsuba"].value(record)
        if apart is not None:
            noise = column["(± Mitsuba)"].value(record)
            assert noise is not None
            assert abs(apart) < 4 * noise + 2e-3, name
            compared += 1
    assert compared > 0


def test_the_lamp_of_its_own_size_gives_as_much_light(zoo: Path) -> None:
    """Same seed, same directions: only rounding and Mitsuba's ray epsilon are between them."""
    for name, record in records(zoo).items():
        assert np.isfinite(record.figures("floor")["at_own_size"]), name
        assert abs(record.figures("floor")["at_own_size"]) < 0.03, name


def test_the_report_names_every_lamp(zoo: Path) -> None:
    text = report(zoo)
    assert all(name in text for name in records(zoo))
    assert (zoo / "zoo.png").is_file()
