"""The benchmark of systems: records, errors, resuming, and systems that fail."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.systems import errors, isolated, subjects
from benchmarks.systems.__main__ import main
from benchmarks.systems.protocol import Frame
from benchmarks.systems.records import Record, Records
from benchmarks.systems.runner import Runner, pairs
from benchmarks.systems.scales import SCALES, Scale
from benchmarks.systems.subjects import Facts
from benchmarks.systems.tasks.task import JudgedTask
from purelight_format.errors import PureLightError
from tests.unit.benchmarks import systems_work
from tests.unit.benchmarks.systems_twin import LEVEL, SIZE, Grey, Noisy, Shared, subject


class Tiny(Scale):
    """One task that needs no lamp."""

    def tasks(self, lamp: str, aperture: float) -> list[JudgedTask]:
        return [Grey()]


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Runner:
    fields = {**vars(SCALES["smoke"]), "samples": (64, 128, 256), "limit": 99}
    facts = Facts(subject(tmp_path), "d", 0.1)
    (tmp_path / "ball.xml").write_text("<scene version='3.0.0'/>")
    monkeypatch.setattr(subjects, "subject", lambda *_: facts)
    monkeypatch.setattr(isolated, "results", lambda make, *words: make(*words))  # no processes
    return Runner(tmp_path / "out", Tiny(**fields), [Noisy()])


def test_records_are_made_once_and_pictures_kept(runner: Runner) -> None:
    runner.run(["ball"])
    found = Records(runner.folder).current()
    assert [r.samples for r in found] == [128, 256]
    assert [r.last for r in found] == [False, True]
    assert found[1].cost["seconds"] == 3
    assert found[1].image(runner.folder).shape == (SIZE, SIZE, 3)
    before = runner.records.path("ball").read_bytes()
    Runner(runner.folder, runner.scale, [Noisy()]).run(["ball"])
    assert runner.records.path("ball").read_bytes() == before
    Runner(runner.folder, runner.scale, [Noisy()], again=("noisy",)).run(["ball"])
    assert len(Records(runner.folder).lines) == 4
    assert len(Records(runner.folder).current()) == 2


def test_truths_that_share_their_light_are_made_together(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each once, but those that are there or have other paths."""
    folder = subjects.subject("ball", runner.folder, "tiny", 1).subject.run
    tasks = [Shared("floor"), Shared("view_side", "appearance"), Shared("roughness")]
    monkeypatch.setattr(Tiny, "tasks", lambda *_: tasks)
    runner.run(["ball"])
    assert (folder / "calls").read_text() == "floor roughness\n"
    assert {r.task for r in Records(runner.folder).current()} == {"floor", "roughness"}
    tasks.append(Shared("room"))
    Runner(runner.folder, runner.scale, [Noisy()]).run(["ball"])
    assert (folder / "calls").read_text() == "floor roughness\nroom\n"


def test_figures_of_a_picture_with_known_noise(runner: Runner) -> None:
    runner.run(["ball"])
    figures = Records(runner.folder).current()[-1].figures
    variance = (1 / 256) / (LEVEL**2 * 1.01)
    assert figures["relative_variance"] == pytest.approx(variance, rel=0.4)
    assert figures["relative_error"] == pytest.approx(variance, rel=0.4)
    assert figures["relative_mse_without_noise"] < 0.5 * variance
    assert figures["mape"] == pytest.approx(math.sqrt(2 / math.pi / 256) / LEVEL, rel=0.25)
    assert abs(figures["mean"]) < 4 * figures["mean_noise"]


def test_noise_that_channels_share_is_told(tmp_path: Path) -> None:
    """A path carries all channels: the mean of a picture is as far off as its standard error."""
    truth, found = Grey().truth(subject(tmp_path), tmp_path, 1), []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        one, more = (
            LEVEL + np.repeat(rng.standard_normal((SIZE, SIZE, 1)), 3, -1) for _ in range(2)
        )
        seen = errors.picture(Frame(one, 1, 1, 0), Frame((one + more) / 2, 2, 2, 0))
        figures = errors.measure(subject(tmp_path), Grey(), seen, truth)
        found.append((figures["mean"], figures["mean_noise"]))
    off, told = np.array(found).T
    assert np.sqrt((told**2).mean()) == pytest.approx(off.std(), rel=0.15)


def test_bias_is_no_noise(runner: Runner) -> None:
    Runner(runner.folder, runner.scale, [Noisy(factor=1.2)]).run(["ball"])
    figures = Records(runner.folder).current()[-1].figures
    assert figures["mean"] == pytest.approx(0.2, abs=0.02)
    assert figures["mape_without_noise"] == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("fails", ["prepare", "frames"])
def test_a_system_that_fails_costs_its_own_cells(runner: Runner, fails: str) -> None:
    systems = [Noisy("broken", fails=fails), Noisy()]
    Runner(runner.folder, runner.scale, systems).run(["ball"])
    found = Records(runner.folder).current()
    assert [r.system for r in found] == ["broken", "noisy", "noisy"]
    assert "\n" not in found[0].failed
    assert ("nothing to be had" if fails == "prepare" else "luck") in found[0].failed
    Runner(runner.folder, runner.scale, systems).run(["ball"])
    assert len(Records(runner.folder).lines) == 3
    mended = [Noisy("broken"), Noisy()]
    Runner(runner.folder, runner.scale, mended, again=("failed",)).run(["ball"])
    assert not any(r.failed for r in Records(runner.folder).current())


def test_the_last_run_of_a_series_counts_alone(runner: Runner) -> None:
    """Neither pictures of a run before nor those before an interruption are mixed with it."""
    runner.run(["ball"])
    broken = Runner(runner.folder, runner.scale, [Noisy(fails="frames")], again=("noisy",))
    broken.run(["ball"])
    assert [r.samples for r in Records(runner.folder).current()] == [0]
    shorter = Tiny(**{**vars(runner.scale), "samples": (64, 128)})
    records, series = Records(runner.folder), ("ball", "noisy", "room")
    key = records.lines[-1].key
    Runner(runner.folder, shorter, [Noisy()], again=("noisy",)).run(["ball"])
    assert [r.samples for r in Records(runner.folder).current()] == [128]
    records = Records(runner.folder)
    for samples in (128, 256):  # begun again, and interrupted
        records.add(replace(records.lines[0], key=key, samples=samples, last=False))
    records.add(replace(records.lines[0], key=key, samples=128, last=False))
    assert [r.samples for r in Records(runner.folder).current()] == [128]
    assert not Records(runner.folder).ended(series, key)


def test_a_key_that_is_not_the_last_is_measured_anew(runner: Runner) -> None:
    """What was measured by one thread, and then by two, is not taken for that by one."""
    for threads in (1, 2, 1):
        Runner(runner.folder, runner.scale, [Noisy()], threads).run(["ball"])
    assert {r.threads for r in Records(runner.folder).current()} == {1}


def test_what_was_made_ready_for_another_lamp_is_made_anew(
    runner: Runner, monkeypatch: pytest.MonkeyPatch
) -> None:
    runner.run(["ball"])
    folder = runner.folder / "ball/systems/noisy"
    (folder / "lamp.plux").write_text("trained for the lamp as it is")
    Runner(runner.folder, runner.scale, [Noisy()], again=("noisy",)).run(["ball"])
    assert (folder / "lamp.plux").is_file()
    facts = replace(subjects.subject("ball", runner.folder, "tiny", 1), digest="other")
    monkeypatch.setattr(subjects, "subject", lambda *_: facts)
    Runner(runner.folder, runner.scale, [Noisy()]).run(["ball"])
    assert not (folder / "lamp.plux").exists()


def test_a_lamp_that_fails_is_written_down(runner: Runner, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> Facts:
        raise PureLightError("no light leaves it")

    with monkeypatch.context() as patch:
        patch.setattr(subjects, "subject", fail)
        runner.run(["ball"])
    assert Records(runner.folder).current()[0].failed == "no light leaves it"
    Runner(runner.folder, runner.scale, [Noisy()]).run(["ball"])
    assert not any(r.failed for r in Records(runner.folder).current())


def test_what_a_series_depends_on_changes_its_key(runner: Runner) -> None:
    facts, task = Facts(subject(runner.folder), "d", 0.1), Grey()
    key = runner.key(facts, Noisy(), task)
    assert key == runner.key(facts, Noisy(), task)
    assert key != runner.key(replace(facts, digest="e"), Noisy(), task)
    assert key != runner.key(facts, Noisy(), Grey("floor"))
    assert key != Runner(runner.folder, runner.scale, [], threads=2).key(facts, Noisy(), task)


def test_series_end_at_the_limit_of_seconds() -> None:
    def frames() -> Iterator[Frame]:
        for count in (1, 2, 4, 8, 16):
            yield Frame(np.zeros((1, 1, 3)), count, float(count), 0.0)

    found = list(pairs(frames(), 7.0))
    assert [(a.samples, b.samples, last) for a, b, last in found] == [(1, 2, False), (2, 4, True)]
    with pytest.raises(PureLightError, match="fewer than two"):
        list(pairs(iter([Frame(np.zeros((1, 1, 3)), 1, 1.0, 0.0)]), 7.0))


def test_parts_of_a_picture_are_independent_and_errors_right() -> None:
    rng = np.random.default_rng(2)
    one, rest = rng.standard_normal((64, 64, 3)), rng.standard_normal((3, 64, 64, 3)).mean(0)
    frame = Frame((one + 3 * rest) / 4, 4, 1, 0)
    seen = errors.picture(Frame(one, 1, 1, 0), frame)
    assert np.allclose(seen.halves[1], rest)
    assert (seen.error**2).mean() == pytest.approx(1 / 4, rel=0.1)
    with pytest.raises(PureLightError, match="go on"):
        errors.picture(frame, frame)


def test_a_picture_of_another_size_is_refused(tmp_path: Path) -> None:
    truth = Grey().truth(subject(tmp_path), tmp_path, 1)
    small = np.ones((4, 4, 3))
    seen = errors.picture(Frame(small, 1, 1, 0), Frame(small, 2, 1, 0))
    with pytest.raises(PureLightError, match="picture is"):
        errors.measure(subject(tmp_path), Grey(), seen, truth)


def test_darkness_has_no_relative_errors(tmp_path: Path) -> None:
    truth = Grey().truth(subject(tmp_path), tmp_path, 1)
    dark = replace(truth, mask=np.zeros((SIZE, SIZE), bool))
    picture = truth.picture
    assert errors.measure(subject(tmp_path), Grey(), picture, dark) == {"dark": True}


def test_a_cut_line_and_an_older_run_do_not_count(tmp_path: Path) -> None:
    records = Records(tmp_path)
    for key, samples in (("old", 1), ("old", 2), ("new", 1)):
        records.add(Record("a", "s", "t", key, samples=samples))
    with open(records.path("a"), "a") as file:
        file.write('{"lamp": "a", "sys')
    again = Records(tmp_path)
    assert [(r.key, r.samples) for r in again.current()] == [("new", 1)]
    again.add(Record("a", "s", "t", "new", samples=2, last=True))
    assert len(Records(tmp_path).current()) == 2
    assert Records(tmp_path).ended(("a", "s", "t"), "new")
    assert not Records(tmp_path).ended(("a", "s", "t"), "old")
    text = records.path("a").read_text().splitlines()[0]
    assert json.loads(text)["system"] == "s"


def test_results_come_from_another_process() -> None:
    assert list(isolated.results(systems_work.other_process, 3)) == [3, 4]
    assert next(isolated.results(systems_work.parent_of_it)) == os.getpid()
    assert next(isolated.results(systems_work.forever)) == 1
    with pytest.raises(PureLightError, match="as it should"):
        list(isolated.results(systems_work.refusing))
    with pytest.raises(PureLightError, match=r"ZeroDivisionError: .* by zero"):
        list(isolated.results(systems_work.dividing))
    with pytest.raises(PureLightError, match="SIGABRT"):
        list(isolated.results(systems_work.aborting))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["--systems", "magic"], "no system magic"),
        (["--tasks", "sea"], "no task sea"),
        (["--lamps", "../moon"], "no lamp ../moon"),
        (["--again", "pth"], "no system or task pth"),
        (["--workers", "2", "--lamps", "moon"], "no lamp moon"),
        (["--report", "--workers", "2"], "no records yet"),
        (["--report"], "no records yet"),
    ],
)
def test_faults_are_told_in_a_line(
    words: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["--output", str(tmp_path), *words]) == 2
    assert reason in capsys.readouterr().err
    assert not any(tmp_path.iterdir())


def test_unknown_lamps_and_presets_are_refused(tmp_path: Path) -> None:
    with pytest.raises(PureLightError, match="no lamp"):
        subjects.subject("moon", tmp_path, "tiny", 1)
    with pytest.raises(PureLightError, match="no preset"):
        subjects.subject("crystal", tmp_path, "huge", 1)
