"""The report of the benchmark of systems, from made-up records."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.systems.own import OWN
from benchmarks.systems.records import Record, Records
from benchmarks.systems.report import claims, drawing, published, report, tables
from benchmarks.systems.report.series import Results, Step, at, reach, within
from benchmarks.systems.tasks.truth import Truth
from purelight_format.errors import PureLightError
from purelight_train.truth.picture import Passes
from tests.unit.benchmarks.systems_twin import Noisy, record

NAMES = ("path", "purelight_accurate", "purelight_fast")


def series(
    system: str, task: str, error: float, seconds: float, floor: float = 0.0, **figures: object
) -> list[Record]:
    """Errors that fall as 1 / samples down to a floor."""
    return [
        record("ball", system, task, n, seconds * n, error / n + floor, **figures)
        for n in (2, 4, 8, 16, 32, 64)
    ]


def bench() -> list[Record]:
    """Our modes, path tracing, and a rival that can do illumination alone and is best at it."""
    made = []
    for task in ("room", "view_side"):
        made += series("path", task, 5e3, 0.01, sharpness=0.9)
        made += series("purelight_accurate", task, 0.1, 0.1, sharpness=0.8)
        made += series("purelight_fast", task, 0.1, 0.05, sharpness=0.8)
    made += series("noisy", "room", 0.01, 0.1)
    made.append(record("ball", "noisy", "floor", 64, 1, 0.1, lux_error=-0.02, lux_absolute=0.03))
    made.append(record("ball", "path", "glare_near", 64, 1, 0.1, ugr_error=-1.5))
    for system, memory in (("purelight_accurate", (300.0, 303.0)), ("path", (240.0, 900.0))):
        for count, peak in zip((1, 16), memory, strict=True):
            made.append(record("ball", system, f"instances_{count}", 4, 1, 0.1, peak))
    return made


def word(text: str, records: list[Record]) -> str:
    found = [v.word for v in claims.verdicts(Results(records)) if text in v.claim.text]
    assert len(found) == 1
    return found[0]


def test_table_marks_the_best_and_tells_why_there_is_a_dash() -> None:
    failed = Record("ball", "purelight_fast", "room", "k2", kind="illumination", failed="no luck")
    lost = [r for r in bench() if (r.system, r.task) != ("purelight_fast", "room")]
    grid = tables.main(Results([*lost, failed]), [*OWN, Noisy()])
    table = {row[1]: dict(zip(grid.head, row, strict=True)) for row in grid.rows}
    assert table["noisy"]["relMSE, lit"] == "**0.000156**"
    assert table["purelight_accurate"]["relMSE, lit"] == "0.00156"
    assert table["purelight_fast"]["relMSE, lit"] == "-"
    assert table["noisy"]["MAPE"] == "-"
    assert table["path"]["UGR"] == "1.50"
    assert table["noisy"]["illuminance"] == "-2.0%"
    assert any("noisy: cannot show appearance" in note for note in grid.notes)
    assert any("no luck" in note for note in grid.notes)
    assert grid.markdown().count("\n| ball |") == 4


def test_equal_time_is_between_the_pictures_of_a_series() -> None:
    results = Results(bench())
    seconds = tables.common_seconds(results)
    assert seconds[("illumination", "ball")] == pytest.approx(6.4)
    grid = tables.equal_time(results, OWN, {("illumination", "ball"): 0.65})
    samples = {row[1]: row[grid.head.index("samples")] for row in grid.rows}
    assert samples == {
        "path": "64", "purelight_accurate": "6", "purelight_fast": "13", "noisy": "6",
    }  # fmt: skip


def test_within_and_reach() -> None:
    steps = [Step(n, 0.1 * n, {"relative_error": 1 / n}) for n in (2, 4, 8)]
    assert within(steps, 0.42) == steps[1]
    assert within(steps, 0.01) == steps[0]
    assert within([], 1) is None
    met = reach(steps, 1 / 6)
    assert met is not None
    assert (met.samples, met.extrapolated) == (pytest.approx(6), False)
    beyond = reach(steps, 1 / 800)
    assert beyond is not None
    assert (beyond.samples, beyond.seconds) == (pytest.approx(800), pytest.approx(80))
    assert beyond.extrapolated
    flat = [Step(n, n, {"relative_error": 0.5}) for n in (2, 4)]
    assert reach(flat, 0.1) is None
    assert reach([], 0.1) is None


def test_a_series_between_its_steps() -> None:
    steps = [Step(n, 0.1 * n, {"relative_error": 1 / n, "mean": n - 3.0}) for n in (2, 4, 8)]
    met = at(steps, 0.4 * 2**0.5)
    assert met is not None
    assert met.samples == 6
    assert met.figures["relative_error"] == pytest.approx(0.25 / 2**0.5)
    assert met.figures["mean"] == pytest.approx(5**0.5)
    middle = at(steps, 0.2 * 2**0.5)
    assert middle is not None
    assert middle.figures["mean"] == pytest.approx(0)  # from -1 to 1
    assert at(steps, 0.01) == steps[0]
    assert at(steps, 7) == at(steps, None) == steps[-1]
    assert at([], 1) is None


def test_csv_is_read_back_as_the_same_records() -> None:
    strips = {"alpha": [0.05, 0.1], "bias": [-0.25, None], "bias_noise": [0.01, None]}
    records = [*bench(), record("ball", "purelight_fast", "roughness", 64, 1, 0.1, **strips)]
    records.append(Record("ball", "wcl", "room", "", "c0de", failed="no luck, at all"))
    known = published.from_csv(published.to_csv(records))
    assert len(known) == len(records)
    for one, other in zip(known, records, strict=True):
        assert one.series == other.series
        assert (one.code, one.samples, one.memory) == (other.code, other.samples, other.memory)
        assert one.seconds == pytest.approx(other.seconds, rel=1e-5)
        assert one.failed == other.failed
        assert {n: v for n, v in one.figures.items() if not isinstance(v, list)} == pytest.approx(
            {n: v for n, v in other.figures.items() if not isinstance(v, list)}, rel=1e-5
        )
    assert known[-2].figures["bias"] == [-0.25, None]
    assert [v.figures for v in claims.verdicts(Results(known))] == [
        v.figures for v in claims.verdicts(Results(records))
    ]


def test_claims_are_judged_by_the_records() -> None:
    records = bench()
    assert word("64 samples", records) == "holds"
    drafts = [r for task in ("room", "view_side") for r in series("purelight_draft", task, 5, 0.1)]
    assert word("whatever the scale's", records) == "not measured"
    assert word("whatever the scale's", [*records, *drafts]) == "does not hold"
    quick = series("purelight_draft_fast", "room", 5, 0.05)
    assert word("for fast mode", [*records, *drafts]) == "not measured"
    assert word("for fast mode", [*records, *drafts, *quick]) == "holds"
    assert word("40 %", records) == "holds"
    assert word("memory", records) == "holds"
    for text in ("NCL", "shell", "histogram", "bias of fast mode falls"):
        assert word(text, records) == "not measured"
    assert {v.word for v in claims.verdicts(Results([]))} == {"not measured"}


def test_claims_can_fail() -> None:
    records = [r for r in bench() if r.system != "path"]
    records += [r for t in ("room", "view_side") for r in series("path", t, 50.0, 0.01)]
    assert word("64 samples", records) == "does not hold"
    slow = [r for r in bench() if r.system != "purelight_fast"]
    slow += series("purelight_fast", "room", 0.1, 0.09)
    assert word("40 %", slow) == "does not hold"
    biased = [r for r in bench() if r.system != "purelight_fast"]
    biased += series("purelight_fast", "room", 0.1, 0.05, mean=-0.2)
    assert word("40 %", biased) == "does not hold"
    ncl = [*bench(), *series("ncl", "view_side", 0.1, 0.1, sharpness=0.95)]
    assert word("NCL", ncl) == "does not hold"
    assert word("NCL", [*bench(), *series("ncl", "view_side", 0.1, 0.1, sharpness=0.5)]) == "holds"
    quiet = [*bench(), *series("histogram", "room", 0.05, 0.1)]
    assert word("histogram", quiet) == "does not hold"
    assert word("histogram", [*bench(), *series("histogram", "room", 0.5, 0.1)]) == "holds"
    grown = [r for r in bench() if r.task != "instances_16"]
    grown.append(record("ball", "purelight_accurate", "instances_16", 4, 1, 0.1, 500.0))
    assert word("memory", grown) == "does not hold"


def test_a_noisy_truth_tells_nothing() -> None:
    records = [
        Record(**{**vars(r), "figures": {**r.figures, "truth_variance": 0.5}}) for r in bench()
    ]
    assert word("64 samples", records) == "too noisy to tell"
    ncl = [*records, *series("ncl", "view_side", 0.1, 0.1, sharpness=0.5)]
    assert word("NCL", ncl) == "too noisy to tell"


def without(system: str, task: str = "") -> list[Record]:
    return [r for r in bench() if r.system != system or (task and r.task != task)]


def test_a_difference_within_its_noise_tells_nothing() -> None:
    vague = [*without("purelight_fast"),
             *series("purelight_fast", "room", 0.1, 0.05, mean=0.02, mean_noise=0.05)]  # fmt: skip
    assert word("40 %", vague) == "too noisy to tell"
    slow = [*without("purelight_fast"),
            *series("purelight_fast", "room", 0.1, 0.09, mean=0.02, mean_noise=0.05)]  # fmt: skip
    assert word("40 %", slow) == "does not hold"
    level = [
        record("ball", "histogram", "room", n, 0.1 * n, 0.1 / n * (0.8, 1.3)[k % 2])
        for k, n in enumerate((2, 4, 8, 16, 32, 64))
    ]
    assert level[-1].figures["relative_variance"] > 0.1 / 64
    assert word("histogram", [*bench(), *level]) == "too noisy to tell"


def test_path_tracing_that_gets_no_nearer_is_said() -> None:
    blind = [r for t in ("room", "view_side") for r in series("path", t, 0.0, 0.01, floor=1.0)]
    records = [*without("path"), *blind]
    assert word("64 samples", records) == "too noisy to tell"
    (found,) = [v for v in claims.verdicts(Results(records)) if "64 samples" in v.claim.text]
    assert "not approached by path tracing" in found.figures["ball"]


def test_means_over_different_views_are_not_compared() -> None:
    """A rival that failed at the hard view has no mean that is like ours."""
    both = [*bench(), *series("purelight_accurate", "view_below", 0.9, 0.1, sharpness=0.2)]
    records = [*both, *series("ncl", "view_side", 0.1, 0.1, sharpness=0.7)]
    assert word("NCL", records) == "not measured"
    whole = [*records, *series("ncl", "view_below", 0.1, 0.1, sharpness=0.1)]
    assert word("NCL", whole) == "holds"


def test_a_verdict_says_on_how_many_lamps_noise_hides_it() -> None:
    other = [
        Record(**{**vars(r), "lamp": "cube", "figures": r.figures | {"truth_variance": 0.5}})
        for r in bench()
    ]
    assert word("64 samples", [*bench(), *other]) == "holds, too noisy to tell on 1"


def test_series_that_stop_a_little_late_have_steps() -> None:
    """LuxCore is looked at while it renders: its counts differ from view to view."""
    made = [record("ball", "bidirectional", "view_side", n, 1, 1 / n) for n in (3, 7, 15, 33)]
    made += [record("ball", "bidirectional", "view_below", n, 1, 1 / n) for n in (4, 6, 13)]
    steps = Results(made).steps("ball", "bidirectional", "appearance")
    assert [s.samples for s in steps] == [4, 6, 14]
    assert steps[-1].figures["relative_error"] == pytest.approx((1 / 15 + 1 / 13) / 2)
    assert steps[-1].tasks == ("view_below", "view_side")


def test_the_report_says_how_it_was_measured(tmp_path: Path) -> None:
    records = Records(tmp_path / "smoke")
    for made in series("path", "room", 1.0, 0.1):
        records.add(Record(**{**vars(made), "threads": 1}))
    assert "Systems had 1 thread." in report.write(records.folder, OWN, None)
    for made in series("ptracer", "room", 1.0, 0.1):
        records.add(Record(**{**vars(made), "threads": 2, "code": "d"}))
    text = report.write(records.folder, OWN, None)
    assert "different numbers of threads (1, 2): seconds do not compare" in text
    assert "2 versions of the code" in text
    assert "ball, path: appearance was not measured" in text


def test_a_claim_may_hold_on_some_lamps() -> None:
    other = [
        Record(**{**vars(r), "lamp": "cube", "memory": 9e3 if r.task == "instances_16" else 1e3})
        for r in bench()
    ]
    assert word("memory", [*bench(), *other]) == "holds on 1 of 2 lamps"


def test_bias_against_roughness_is_drawn_and_judged() -> None:
    strips = {"alpha": [0.05, 0.1, 0.3, 0.8], "bias": [-0.3, -0.2, None, 0.01]}
    noise = {"bias_noise": [0.01, 0.01, None, 0.01]}
    made = [record("ball", "purelight_fast", "roughness", 64, 1, 0.1, **strips, **noise)]
    assert drawing.roughness(Results(made)).keys() == {"roughness_ball"}
    assert word("bias of fast mode falls", made) == "holds"
    vague = noise | {"bias_noise": [0.5, 0.5, None, 0.5]}
    made = [record("ball", "purelight_fast", "roughness", 64, 1, 0.1, **strips, **vague)]
    assert word("bias of fast mode falls", made) == "too noisy to tell"
    turned = strips | {"bias": [0.0, 0.01, -0.2, -0.3]}
    made = [record("ball", "purelight_fast", "roughness", 64, 1, 0.1, **turned, **noise)]
    assert word("bias of fast mode falls", made) == "does not hold"


def picture(folder: Path, made: Record) -> Record:
    """A record with a picture of its samples' noise."""
    name = f"{made.lamp}-{made.system}-{made.task}-{made.samples}.npz"
    noise = np.random.default_rng(0).standard_normal((8, 8, 3)) / math.sqrt(made.samples)
    np.savez(folder / name, image=1 + noise)
    return Record(**{**vars(made), "picture": name})


def test_the_report_holds_everything(tmp_path: Path) -> None:
    records = Records(tmp_path)
    for made in bench():
        records.add(picture(tmp_path, made))
    records.add(Record("cube", "", "", "lamp", failed="no light leaves it"))
    sums = Passes()
    for _ in range(2):
        sums.add(np.ones((8, 8, 3)))
    truth = Truth(sums.picture(), np.ones((8, 8), bool), 100, 0)
    truth.save(tmp_path / "ball/truth/room-1.npz")
    (tmp_path / "ball/truth/room.txt").write_text("room-1.npz")
    (tmp_path / "published").mkdir()
    (tmp_path / "published/row_ball_view_gone.png").touch()
    text = report.write(tmp_path, [*OWN, Noisy()], tmp_path / "published")
    assert "no light leaves it" in text
    assert "**holds**: memory" in text
    for folder in (tmp_path / "report", tmp_path / "published"):
        names = {path.name for path in folder.iterdir()}
        assert names == {
            "results.csv", "results.md", "index.html", "front_ball_appearance.png",
            "front_ball_illumination.png", "memory_ball.png", "row_ball_room.png",
            "series_ball.csv",
        }  # fmt: skip
    every, last = (
        list(csv.DictReader(io.StringIO((tmp_path / f"report/{name}.csv").read_text())))
        for name in ("series_ball", "results")
    )
    series = {(r["lamp"], r["system"], r["task"]) for r in every}
    assert len(every) > len(series) == len(last) - 1  # and the lamp that failed
    assert all(row in last for row in every if row["samples"] == "64" and row["system"] == "path")
    page = (tmp_path / "published/index.html").read_text()
    assert page.count("data:image/png") == 4
    assert 'src="http' not in page
    again = Image.open(tmp_path / "report/row_ball_room.png")
    assert again.size[0] == 5 * (again.size[0] // 5)


def test_lamps_that_were_published_before_stay(tmp_path: Path) -> None:
    """What takes hours may be measured lamp by lamp, on other days or machines."""
    target = tmp_path / "published"
    for lamp in ("ball", "cube"):
        for made in bench():
            Records(tmp_path / lamp).add(Record(**{**vars(made), "lamp": lamp, "code": lamp}))
    report.write(tmp_path / "ball", [*OWN, Noisy()], target)
    (target / "row_ball_room.png").write_bytes(b"a picture")
    (target / "row_gone_room.png").write_bytes(b"of no lamp")
    text = report.write(tmp_path / "cube", [*OWN, Noisy()], target)
    assert "| ball |" not in text
    both = (target / "results.md").read_text()
    assert both.count("| ball | path |") == both.count("| cube | path |") == 2
    assert "2 versions of the code: ball (ball); cube (cube)" in both
    assert (target / "row_ball_room.png").read_bytes() == b"a picture"
    assert not (target / "row_gone_room.png").exists()
    assert (target / "front_ball_appearance.png").is_file()
    once = {p.name: p.read_bytes() for p in target.iterdir()}
    report.write(tmp_path / "cube", [*OWN, Noisy()], target)
    assert {p.name: p.read_bytes() for p in target.iterdir()} == once


@pytest.mark.parametrize(
    "text", ["", "\n", "lamp,system\nball,path\n", "\0", published.to_csv(bench()) + "ball,path\n"]
)
def test_what_was_not_published_here_is_refused(tmp_path: Path, text: str) -> None:
    Records(tmp_path / "cube").add(record("cube", "path", "room", 2, 1, 0.1))
    (tmp_path / "published").mkdir()
    (tmp_path / "published/series_ball.csv").write_text(text)
    with pytest.raises(PureLightError, match=r"series_ball.csv: not published by this benchmark"):
        report.write(tmp_path / "cube", OWN, tmp_path / "published")


def test_systems_stand_in_the_order_of_the_bench(tmp_path: Path) -> None:
    for made in reversed(bench()):
        Records(tmp_path).add(made)
    text = report.write(tmp_path, [*reversed(OWN), Noisy()], None)
    assert text.index("| ball | purelight_fast |") < text.index("| ball | path |")
    text = report.write(tmp_path, [*OWN, Noisy()], None)
    assert text.index("| ball | path |") < text.index("| ball | purelight_fast |")


def test_floors_are_compared_at_equal_time() -> None:
    made = [*series("purelight_accurate", "floor", 0.1, 0.1, lux_absolute=0.01)]
    made += [record("ball", "path", "floor", n, 0.2 * n, 1, lux_absolute=1 / n) for n in (16, 64)]
    found = Results(made)
    last, equal = (
        found.chosen("ball", "path", "floor", equal_time=equal)[0].samples
        for equal in (False, True)
    )
    assert (last, equal) == (64, 32)  # in 6.4 s


def test_rows_are_chosen_at_equal_time() -> None:
    found = [r for r in bench() if (r.system, r.task) == ("purelight_fast", "room")]
    chosen = within(found, 0.45)
    assert chosen is not None
    assert chosen.samples == 8
    assert within([], 1) is None


def test_pictures_belong_to_the_longest_name() -> None:
    lamps = ["flower", "flower_specular"]
    owners = [report._owner(f"front_{lamp}_appearance.png", lamps) for lamp in lamps]
    assert owners == lamps
    assert report._owner("memory_flower_specular.png", lamps) == "flower_specular"
    assert report._owner("results.csv", lamps) == ""


def test_a_large_page_that_is_published_has_its_pictures_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for made in bench():
        Records(tmp_path).add(made)
    monkeypatch.setattr(report, "LIMIT", 25_000)
    report.write(tmp_path, OWN, tmp_path / "published")
    assert "data:image" in (tmp_path / "report/index.html").read_text()
    page = (tmp_path / "published/index.html").read_text()
    assert "data:image" not in page
    assert 'src="front_ball_appearance.png"' in page
    monkeypatch.setattr(report, "LIMIT", 1000)
    with pytest.raises(PureLightError, match="publish fewer lamps"):
        report.write(tmp_path, OWN, tmp_path / "nothing")
    assert not (tmp_path / "nothing").exists()
