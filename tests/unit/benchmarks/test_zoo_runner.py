"""Unattended runs: limits, what is left out, what is done again, and the tables."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.zoo import sheet, table
from benchmarks.zoo.__main__ import report
from benchmarks.zoo.columns import COLUMNS
from benchmarks.zoo.lamps.lamp import make
from benchmarks.zoo.published import publish, recall
from benchmarks.zoo.record import PORTRAIT, STAGES, Record
from benchmarks.zoo.runner import Job, Limits, resident, run
from benchmarks.zoo.settings import TINY, settings
from benchmarks.zoo.worker import Worker, attempt, command
from purelight_format import atomic
from purelight_format.errors import PureLightError

ENDLESS = Limits(60, float("inf"))


class Scripted(Job):
    """A job whose process runs a script instead of a lamp's stages."""

    script = "pass"

    def start(self) -> subprocess.Popen[bytes]:
        words = [sys.executable, "-c", self.script, str(self.folder)]
        return subprocess.Popen(words, stderr=subprocess.DEVNULL)


def job(folder: Path, script: str = "pass", stages: tuple[str, ...] = STAGES) -> Scripted:
    made = Scripted(make(1, 3), folder, "tiny", stages, 1)
    object.__setattr__(made, "script", script)
    made.prepare([])
    return made


def finished(folder: Path, **figures: Any) -> Record:
    """A record with all stages ended well."""
    record = Record(folder, "key", make(1, 3).description())
    for stage in STAGES:
        record.stages[stage] = {"seconds": 1.0, "code": "a", "figures": figures.get(stage, {})}
    record.save()
    return record


# Figures in the repository


def published_job(output: Path, kept: Path) -> Job:
    """A lamp's measured record in the repository, and a job of the same lamp elsewhere."""
    one = Job(make(1, 3), output / "1" / "03-desk", "tiny", STAGES, 1)
    record = finished(kept.parent / "1" / "03-desk")
    record.key = one.key()
    record.save()
    publish(kept.parent / "1", kept)
    return one


def test_a_published_record_is_gone_on_from(tmp_path: Path) -> None:
    one = published_job(tmp_path / "new", tmp_path / "kept")
    assert recall(one, tmp_path / "kept")
    assert one.missing == []
    assert list(run([one], ENDLESS, 1)) == []


def test_what_was_measured_here_counts_more_than_what_is_published(tmp_path: Path) -> None:
    one = published_job(tmp_path / "new", tmp_path / "kept")
    one.prepare([])
    assert not recall(one, tmp_path / "kept")
    assert one.missing == list(STAGES)


@pytest.mark.parametrize("fault", ["another lamp", "a stage is missing"])
def test_a_published_record_that_does_not_do_is_left(tmp_path: Path, fault: str) -> None:
    one = published_job(tmp_path / "new", tmp_path / "kept")
    file = tmp_path / "kept" / "1" / "03-desk.json"
    data = json.loads(file.read_text())
    if fault == "another lamp":
        data["key"] = "other"
    else:
        del data["stages"]["room"]
    file.write_text(json.dumps(data))
    assert not recall(one, tmp_path / "kept")
    assert not Record(one.folder).path.exists()


@pytest.mark.parametrize("all_made_here", [False, True])
def test_portraits_are_published_where_all_lamps_have_one(
    tmp_path: Path, all_made_here: bool
) -> None:
    folder, kept = tmp_path / "1", tmp_path / "kept"
    made = finished(folder / "03-desk").folder, finished(folder / "04-screen").folder
    for one in made[: 1 + all_made_here]:
        (one / PORTRAIT).write_bytes(b"a lamp")
    for name in ("zoo.md", "zoo.png"):
        (folder / name).write_text("new")
        atomic.write_bytes(kept / "1" / name, b"old")
    publish(folder, kept)
    assert (kept / "1" / "zoo.md").read_text() == "new"
    assert (kept / "1" / "zoo.png").read_text() == ("new" if all_made_here else "old")


def test_rows_tell_which_code_they_are_of(tmp_path: Path) -> None:
    old, new = finished(tmp_path / "03-desk"), finished(tmp_path / "04-screen")
    old.stages["room"]["code"] = "bcdefg"
    text = table.markdown({"03-desk": old, "04-screen": new})
    assert "2 lamps, 2 measured, code a, bcdefg" in text
    assert "| 03-desk | a bcde |" in text
    assert "| 04-screen | a |" in text


def test_a_record_does_not_tell_where_it_was_made(tmp_path: Path) -> None:
    record = finished(tmp_path, export={"said": f"{tmp_path}/lamp.usda  0.33 MB"})
    record.end("train", {"refused": f"{tmp_path}/lamp/lamp.xml: no emitter"})
    assert str(tmp_path) not in record.path.read_text()
    assert Record.open(tmp_path).figures("export")["said"] == "lamp.usda  0.33 MB"


# Limits


def test_a_lamp_that_takes_too_long_is_stopped(tmp_path: Path) -> None:
    slow = job(tmp_path, "import time; time.sleep(60)")
    assert [one.folder for one in run([slow], Limits(0.1, float("inf")), 1)] == [tmp_path]
    assert Record.open(tmp_path).stopped == "make failed: stopped after 0 s"


@pytest.mark.skipif(
    resident(1) == 0 and resident(0) == 0 and sys.platform != "linux", reason="/proc"
)
def test_a_lamp_that_takes_too_much_memory_is_stopped(tmp_path: Path) -> None:
    hungry = job(tmp_path, "import time; x = b'1' * (200 << 20); time.sleep(60)")
    list(run([hungry], Limits(60, 100 << 20), 1))
    assert Record.open(tmp_path).stopped == "make failed: stopped at 0.1 GiB of memory"


def test_a_crash_ends_its_stage_and_the_rest_goes_on(tmp_path: Path) -> None:
    """A stage that kills its process is noted, and the stages after it are run."""
    script = (
        "import os, sys, signal; from pathlib import Path\n"
        "from benchmarks.zoo.record import Record\n"
        "record = Record.open(Path(sys.argv[1]))\n"
        "for stage in ('flux', 'floor', 'room'):\n"
        "    if stage in record.stages: continue\n"
        "    record.begin(stage)\n"
        "    if stage == 'floor': os.kill(os.getpid(), signal.SIGKILL)\n"
        "    record.end(stage, {'seconds': 0, 'code': 'a', 'figures': {}})\n"
    )
    list(run([job(tmp_path, script, ("flux", "floor", "room"))], ENDLESS, 1))
    stages = Record.open(tmp_path).stages
    assert stages["floor"]["failed"] == "ended by SIGKILL"
    assert "figures" in stages["flux"]
    assert "figures" in stages["room"]


def test_lamps_run_side_by_side(tmp_path: Path) -> None:
    names = [str(k) for k in range(3)]
    jobs = [job(tmp_path / name, "raise SystemExit(3)") for name in names]
    assert sorted(one.folder.name for one in run(jobs, ENDLESS, 2)) == names
    for name in names:
        assert Record.open(tmp_path / name).stopped == "make failed: ended with code 3, see log.txt"


# What is done again


def test_only_what_is_missing_is_done(tmp_path: Path) -> None:
    one = job(tmp_path)
    assert one.missing == list(STAGES)
    record = finished(tmp_path)
    record.key = one.key()
    record.save()
    one.prepare([])
    assert one.missing == []
    assert list(run([one], ENDLESS, 1)) == []
    one.prepare(["room"])
    assert one.missing == ["room"]
    one.prepare(["export"])
    assert one.missing == list(STAGES[STAGES.index("export") :])


def test_failures_stand_until_they_are_done_again(tmp_path: Path) -> None:
    one = job(tmp_path)
    record = finished(tmp_path)
    record.key = one.key()
    record.end("room", {"seconds": 1, "code": "a", "failed": "ValueError: no"})
    one.prepare([])
    assert one.missing == []
    one.prepare(["failed"])
    assert one.missing == ["room"]


def test_results_of_other_settings_are_not_touched(tmp_path: Path) -> None:
    finished(tmp_path)  # of another key
    with pytest.raises(PureLightError, match="another preset"):
        job(tmp_path)
    assert set(Record.open(tmp_path).stages) == set(STAGES)


def test_the_key_is_that_of_lamp_and_settings(tmp_path: Path) -> None:
    one = job(tmp_path)
    assert one.key() == job(tmp_path / "b").key()
    other = Scripted(make(1, 4), tmp_path, "tiny", STAGES, 1)
    dearer = Scripted(make(1, 3), tmp_path, "draft", STAGES, 1)
    assert len({one.key(), other.key(), dearer.key()}) == 3


# What a stage says


def test_a_refusal_is_one_line() -> None:
    def refuse() -> dict[str, Any]:
        raise PureLightError("no light\nescapes")

    assert attempt(refuse) == {"refused": "no light escapes"}
    assert attempt(lambda: {"x": 1 / 0}) == {"failed": "ZeroDivisionError: division by zero"}
    assert attempt(lambda: {"x": 1}) == {"figures": {"x": 1}}


def test_commands_end_in_their_own_words() -> None:
    def refuse(words: list[str]) -> int:
        print("working\npurelight-train: error: the lamp is dark", file=sys.stderr)
        return 2

    with pytest.raises(PureLightError, match=r"^the lamp is dark$"):
        command(refuse, [])
    assert command(lambda words: print(*words) or 0, ["a", "b"]) == "a b"


def test_a_lamp_that_cannot_be_made_has_no_other_stages(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(self: Worker) -> dict[str, Any]:
        raise PureLightError("too odd")

    monkeypatch.setattr(Worker, "_make", refuse)
    Worker(make(1, 3), tmp_path, TINY)(list(STAGES))
    record = Record.open(tmp_path)
    assert list(record.stages) == ["make"]
    assert record.stopped == "make refused: too odd"


def test_unknown_presets_are_refused() -> None:
    with pytest.raises(PureLightError, match="no preset coarse"):
        settings("coarse")


# Tables


def column(title: str) -> Any:
    return next(c for c in COLUMNS if c.title == title)


def test_distribution_and_worst_lamps(tmp_path: Path) -> None:
    values = {"a": 0.01, "b": -0.5, "c": 0.03, "d": 0.02, "e": 0.04, "f": -0.05, "g": None}
    records = {
        name: finished(
            tmp_path / name,
            floor={"accurate": {"mean": value}},
            sampler={"effective_sample_size_of_light": 1 - abs(value or 0)},
        )
        for name, value in values.items()
    }
    found = table.distribution(column("floor"), records)
    assert found is not None
    assert found["lamps"] == 6
    assert found["median"] == pytest.approx(0.035)
    assert found["worst"] == 0.5
    assert list(found["worst_lamps"]) == ["b", "f", "e", "c", "d"]
    size = table.distribution(column("ESS"), records)
    assert size is not None
    assert size["worst"] == 0.5
    assert next(iter(size["worst_lamps"])) == "b"


def test_figures_that_are_not_known_are_left_out(tmp_path: Path) -> None:
    record = finished(
        tmp_path,
        flux={"student_over_traced": [1.02, None, 0.9]},
        floor={"irradiance": [1.0, 2.0, 3.0], "rendered": [1.0, 2.0, 3.3],
               "standard_error": [0.0, 0.0, 0.03]},
        reference={"irradiance": 2.0, "standard_error": 0.01, "settled": True},
        appearance={"path_traced": {"mean": 0.3, "settled": False}},
        room={"variance_fast_over_accurate": float("nan")},
    )  # fmt: skip
    assert column("flux").value(record) == pytest.approx(-0.1)
    assert column("floor, Mitsuba").value(record) == pytest.approx(0.05)
    assert column("tracer, Mitsuba").value(record) == pytest.approx(0.0)
    assert column("(± Mitsuba)").value(record) == pytest.approx(np.hypot(0.01, 0.01) / 2)
    assert column("view, path traced").value(record) is None
    assert column("variance, fast").value(record) is None
    assert column("near").cell(record) == "-"


def test_the_report_tells_what_went_wrong(tmp_path: Path) -> None:
    finished(tmp_path / "00-good", floor={"accurate": {"mean": 0.01}})
    odd = finished(tmp_path / "01-odd")
    odd.warnings = ["glass is inside out"]
    odd.end("room", {"seconds": 1.0, "code": "b", "failed": "MemoryError: x"})
    dark = Record(tmp_path / "02-dark", "key", make(1, 3).description())
    dark.end("make", {"seconds": 1.0, "code": "a", "figures": {}})
    dark.end("train", {"seconds": 1.0, "code": "a", "refused": "the lamp emits nothing"})
    text = report(tmp_path)
    assert "3 lamps, 2 measured, code a, b" in text
    assert "| 00-good |" in text
    assert "02-dark: train refused: the lamp emits nothing" in text
    assert "01-odd: room: MemoryError: x" in text
    assert "01-odd: glass is inside out" in text
    assert (tmp_path / "zoo.md").read_text() == text
    assert (tmp_path / "zoo.json").is_file()


def test_strips_show_where_ours_is_brighter() -> None:
    truth = np.full((4, 4, 3), 2.0)
    ours = truth * np.array([2.0, 0.5])[np.arange(4) // 2][None, :, None]
    mask = np.ones((4, 4), bool)
    mask[0] = False
    row = sheet.strip(truth, ours, mask)
    assert row.shape == (4, 12, 3)
    difference = row[:, 8:]
    assert (difference[0] == 0).all()
    assert (difference[1:, :2, 0] > 200).all()
    assert (difference[1:, 2:, 2] > 200).all()
