"""The gallery's command: what it makes, what one failure costs, and what it shows."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tqdm import tqdm

from purelight_examples.gallery import cli, runner, sheet
from purelight_examples.gallery.gallery import Gallery
from purelight_examples.gallery.lamp_job import LampJob
from purelight_examples.gallery.settings import Settings
from purelight_examples.gallery.shown import LampShown
from purelight_examples.luminaires.catalog import CATALOG
from purelight_examples.scenes.interiors import INTERIORS
from purelight_examples.scenes.sensor import Picture
from purelight_examples.stages import input_digest
from purelight_onnx.picture import write_exr
from tests.support import lamp as bundles

WHY = "the lamp fell down"
SETTINGS = Settings(wall=Picture(20, 16, 4))


def made(folder: Path, name: str) -> None:
    """What a lamp's worker leaves."""
    home = folder / name
    (home / ".stages").mkdir(parents=True)
    (home / "lamp.plux").write_bytes(bundles.seal(bundles.good()))
    rng = np.random.default_rng(0)
    for kind, size in (("portrait", (8, 8)), ("seen", (8, 8)), ("wall", (16, 20))):
        write_exr(home / f"{kind}.exr", rng.random((*size, 3)).astype(np.float32))
    figures = {
        "lamp": {"triangles": 1234},
        "train": {"seconds": 61.0},
        "export": {"bytes": 2_000_000},
    }
    for stage, found in figures.items():
        text = json.dumps({"digest": "", "seconds": 1.0, "figures": found})
        (home / ".stages" / f"{stage}.json").write_text(text)


@pytest.fixture
def worker(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, str]]:
    """Replaces the process of a task: `medieval` fails, others leave what they should."""
    started: list[tuple[str, str]] = []

    def start(self: runner.Task) -> subprocess.Popen[bytes]:
        started.append((self.kind, self.name))
        bad = self.name == "medieval"
        if not bad and self.kind == "lamp":
            made(self.gallery, self.name)
        if self.kind == "room":
            write_exr(self.folder / "room.exr", np.ones((6, 8, 3), np.float32))
        said = "purelight-gallery: error: the lamp fell down" if bad else "[1/1] Done ... in 1 s"
        code = f"print({said!r}); raise SystemExit({2 * bad})"
        with open(self.log, "wb") as log:
            return subprocess.Popen([sys.executable, "-c", code], stdout=log, stderr=log)

    monkeypatch.setattr(runner.Task, "_start", start)
    return started


def test_a_lamp_that_fails_costs_itself_and_its_rooms_alone(
    tmp_path: Path, worker: list[tuple[str, str]], capsys: pytest.CaptureFixture[str]
) -> None:
    lamps = ["cluster", "medieval", "crystal"]
    gallery = Gallery.of(tmp_path, lamps, None, SETTINGS)
    assert gallery.rooms == ("cornell_box", "elevator_hall")
    failed = gallery()
    assert [(o.kind, o.name) for o in failed] == [("lamp", "medieval"), ("room", "cornell_box")]
    assert worker == [("lamp", name) for name in lamps] + [("room", "elevator_hall")]
    said = capsys.readouterr()
    assert said.err == ""  # no bar where nobody watches
    lines = said.out.splitlines()
    assert len(lines) == 5
    assert lines[0].startswith("[1/5] cluster: done in ")
    assert "triangles 1,234, training 61 s, file 2.0 MB" in lines[0]
    assert lines[1] == f"[2/5] medieval: failed: {WHY}; see {tmp_path}/medieval/log.txt"
    assert lines[3] == "[4/5] cornell_box: failed: no medieval"
    with Image.open(tmp_path / "sheet.png") as picture:
        assert picture.width > 2 * (sheet.SIDE + sheet.WIDE)
    page = gallery.page.read_text()
    assert page.count("data:image/png") == 2 * 3 + 1
    assert WHY in page


def test_every_lamp_is_in_the_gallery_and_every_room() -> None:
    gallery = Gallery.of(Path("out"), None, None, SETTINGS)
    assert gallery.lamps == tuple(CATALOG)
    assert gallery.rooms == tuple(INTERIORS)
    described = "\n".join(gallery.description())
    assert all(name in described for name in (*CATALOG, *INTERIORS))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--lamps", "sun"], "no lamp is called sun; there are cluster, "),
        (["--lamps", "crystal", "crystal"], "a lamp is named twice"),
        (["--rooms", "attic"], "no room is called attic; there are cornell_box, "),
        (["--lamps", "cluster", "--rooms", "kitchen"], "kitchen needs linear_led"),
    ],
)
def test_wrong_names_are_one_line(
    words: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["--output", str(tmp_path / "out"), *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("purelight-gallery: error: " + message)
    assert not (tmp_path / "out").exists()


def test_no_threads_are_one_line_and_no_failed_lamp(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        cli.main(["--output", str(tmp_path / "out"), "--threads", "0"])
    assert "--threads: 0: give a whole number from 1" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_an_output_that_is_a_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "taken").write_text("x")
    assert cli.main(["--output", str(tmp_path / "taken"), "--lamps", "crystal"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_worker_that_dies_without_a_word_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start(self: runner.Task) -> subprocess.Popen[bytes]:
        self.log.write_bytes(b"")
        return subprocess.Popen([sys.executable, "-c", "import os; os.abort()"])

    monkeypatch.setattr(runner.Task, "_start", start)
    task = runner.Task("lamp", "crystal", tmp_path / "crystal", tmp_path, SETTINGS)
    assert task(tqdm(disable=True)).fault == f"exit code -6; see {tmp_path}/crystal/log.txt"


def test_the_stage_is_read_from_the_log(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    log.write_text("")
    assert runner.stage(log) == "starting"
    log.write_text("[1/7] Building the lamp: done before, in 1 s\n[2/7] Training (draft) ... about "
                   "5 min left\nstudent:  3%|█  | 9/300\rstudent:  4%|█  | 10/300")  # fmt: skip
    assert runner.stage(log) == "Training (draft)"


def test_settings_survive_the_way_to_another_process() -> None:
    settings = Settings(preset="standard", threads=1, room=Picture(10, 8, 2))
    assert Settings.from_json(settings.to_json()) == settings


def digests(job: LampJob) -> dict[str, str]:
    found, digest = {}, ""
    for stage in job.stages():
        digest = found[stage.name] = input_digest(digest, stage)
    return found


def test_another_preset_trains_again_and_another_picture_does_not(tmp_path: Path) -> None:
    job = LampJob("downlight", tmp_path, SETTINGS)
    before = digests(job)
    assert list(before) == ["lamp", "train", "export", "validate", "portrait", "seen", "wall"]
    trained = digests(replace(job, settings=replace(SETTINGS, preset="standard")))
    assert (trained["lamp"] == before["lamp"], trained["train"] == before["train"]) == (True, False)
    looked = digests(replace(job, settings=replace(SETTINGS, wall=Picture(40, 32, 4))))
    assert [k for k in before if looked[k] != before[k]] == ["wall"]


def test_other_shapes_train_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    job = LampJob("downlight", tmp_path, SETTINGS)
    before = digests(job)["lamp"]
    entry = CATALOG["downlight"]
    smaller = replace(entry, lamp=replace(entry.lamp, trim=0.05))  # type: ignore[type-var]
    monkeypatch.setitem(CATALOG, "downlight", smaller)
    assert digests(job)["lamp"] != before


def test_figures_are_those_of_the_bundle(tmp_path: Path) -> None:
    made(tmp_path, "crystal")
    shown = LampShown(tmp_path, "crystal")
    flux = np.array(shown.manifest.flux)
    assert shown.lumens == pytest.approx(683 * flux @ (0.2126, 0.7152, 0.0722), rel=1e-3)
    for kind in ("portrait", "seen", "wall"):
        image, grade = shown.picture(kind)
        assert np.isfinite([*grade.gains, grade.stops]).all()
        assert image.shape[2] == 3


@pytest.mark.slow
def test_the_whole_way_of_one_lamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Built, trained, exported, validated, rendered; and nothing is done a second time."""
    from purelight_mitsuba import platform
    from purelight_train.presets import PRESETS
    from tests.support.tiny import TINY

    platform.use()
    monkeypatch.setitem(PRESETS, "tiny", TINY)
    small = Settings("tiny", 1, 16, 4, 16, 2, Picture(20, 16, 4), Picture(20, 16, 4))
    job = LampJob("downlight", tmp_path / "downlight", small)
    records = job()
    assert (tmp_path / "downlight" / "wall.exr").is_file()
    assert LampShown(tmp_path, "downlight").line().startswith("light ")
    bundle = job.bundle.stat().st_mtime_ns
    assert job() == records
    assert job.bundle.stat().st_mtime_ns == bundle
