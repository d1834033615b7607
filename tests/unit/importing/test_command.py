"""The command: what it writes, what it says, and its one line about faults."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from purelight_import import Options, import_lamp
from purelight_import.cli import main
from tests.support.lamp_files import glb, mitsuba, model, obj, usd
from tests.support.lamp_files.model import Piece


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return glb.write(tmp_path, model.lamp())


def test_what_it_writes_and_says(
    path: Path, mitsuba: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "made" / "lamp"
    assert main([str(path), "--output", str(out), "--emitter", "Bulb=806lm,2700K"]) == 0
    said, notes = capfd.readouterr()
    assert {p.name for p in out.iterdir()} == {
        "shelf_light.xml", "shelf_light.png", "meshes", "parts.txt", "parts.json"
    }  # fmt: skip
    assert "806 lm" in said
    assert "120 x 120 x 120" in said
    assert f"purelight-train {out}/shelf_light.xml" in said
    assert "warning" not in notes
    record = json.loads((out / "parts.json").read_text())
    assert record["options"] == {"emitters": ["Bulb=806lm,2700K"]}
    assert record["doubts"] == []
    assert mitsuba.load_file(str(out / "shelf_light.xml"))  # with Mitsuba's own optimisations
    check_portrait(out / "shelf_light.png")


def check_portrait(path: Path) -> None:
    """It shows the lamp unlit on the left, and lit on the right."""
    picture = np.asarray(Image.open(path), np.float64) / 255
    height, width, _ = picture.shape
    assert width == 2 * height
    unlit, lit = picture[:, :height], picture[:, height:]
    bulb = (slice(int(0.42 * height), int(0.58 * height)),) * 2
    corner = (slice(0, 20), slice(0, 20))
    assert lit[bulb].max() > 0.95
    assert lit[corner].max() < 0.5 < unlit[corner].min()
    base = unlit[int(0.12 * height) : int(0.2 * height), int(0.45 * height) : int(0.55 * height)]
    assert (base[..., 0] > base[..., 2] + 0.1).mean() > 0.5  # brass, above the globe


def test_parts_are_left_out_or_kept_apart(path: Path, mitsuba: Any, tmp_path: Path) -> None:
    options = Options(omit=("gl?be",), keep=("Brass",))
    made = import_lamp(path, tmp_path / "out", options, picture=False)
    assert [row["name"] for row in made.parts] == ["Bulb"]
    kept = tmp_path / "out" / "kept.xml"
    (shape,) = mitsuba.load_file(str(kept)).shapes()
    box = shape.bbox()
    np.testing.assert_allclose(np.array(box.center()).ravel(), [0, 0, 0.08], atol=1e-6)
    assert not shape.is_emitter()


@pytest.mark.parametrize("units", [None, "cm"])
def test_what_is_kept_apart_has_the_lamps_scale(
    units: str | None, mitsuba: Any, tmp_path: Path
) -> None:
    """A floor lamp in centimetres, of which the pole decides how large it is."""
    pole = Piece("Pole", model.box((0.02, 0.02, 1.3), (0, 0, -0.65)), "Steel", model.base().words)
    source = obj.write(tmp_path, [model.bulb(), pole])
    options = Options(units=units, keep=("Pole",))
    made = import_lamp(source, tmp_path / "out", options, picture=False)
    record = json.loads((tmp_path / "out" / "parts.json").read_text())
    ((lamp,), (kept,)) = made.parts, record["kept"]
    assert kept["size"][2] / lamp["size"][2] == pytest.approx(1.3 / 0.04, rel=0.01)


def test_into_the_working_folder(
    path: Path, mitsuba: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stays the folder in which the user's shell is."""
    out = tmp_path / "here"
    out.mkdir()
    monkeypatch.chdir(out)
    for _ in range(2):
        assert main([str(path), "--output", ".", "--no-picture"]) == 0
        assert Path.cwd() == out
        assert (Path() / "shelf_light.xml").is_file()
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--omit", "Shade"], "--omit Shade: no part has that name"),
        (["--keep", "Shade"], "--keep Shade: no part"),
        (["--glass", "Shade=thin"], "--glass Shade: no part"),
        (["--emitter", "Shade"], "--emitter Shade: no part"),
        (["--omit", "*"], "nothing of the lamp is left"),
        (["--omit", "Bulb"], "nothing in the file emits"),
        (["--name", "///"], "--name"),
    ],
)
def test_names_that_fit_nothing(options: list[str], words: str, path: Path, fault: Any) -> None:
    assert words in fault(path, *options)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--units", "furlong"], "give m, dm, cm"), (["--units", "-1"], "give m, dm, cm"),
        (["--up", "w"], "invalid choice"), (["--lumens", "0"], "above 0"),
        (["--kelvin", "12"], "give 500 to 25000"), (["--emitter", "a=b"], "NAME=806lm"),
        (["--glass", "a"], "NAME=solid or NAME=thin"),
    ],
)  # fmt: skip
def test_wrong_options_are_one_line(
    options: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main(["lamp.glb", "--output", "out", *options])
    assert caught.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_files_that_are_none(tmp_path: Path, fault: Any) -> None:
    assert "no such file" in fault(tmp_path / "lamp.glb")
    (tmp_path / "lamp.fbx").write_bytes(b"")
    assert "'.fbx' is not read" in fault(tmp_path / "lamp.fbx")
    (tmp_path / "lamp.glb").mkdir()
    assert "no such file" in fault(tmp_path / "lamp.glb")
    (tmp_path / "far.glb").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    assert "pointer of Git LFS" in fault(tmp_path / "far.glb")
    (tmp_path / "empty.glb").touch()
    assert fault(tmp_path / "empty.glb").endswith("the file is empty")
    os.mkfifo(tmp_path / "pipe.glb")
    assert "no such file" in fault(tmp_path / "pipe.glb")


def test_a_folder_that_cannot_be_written_is_told_before_reading(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main([str(tmp_path / "none.glb"), "--output", str(tmp_path / "file" / "out")]) == 2
    assert "cannot write" in capfd.readouterr().err


def test_an_import_replaces_an_earlier_one_but_nothing_else(
    path: Path, mitsuba: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    arguments = [str(path), "--output", str(out), "--no-picture"]
    assert main([*arguments, "--name", "First"]) == 0
    assert main([*arguments, "--name", "Second"]) == 0
    assert sorted(p.name for p in out.glob("*.xml")) == ["Second.xml"]
    scene = out / "Second.xml"
    scene.write_text(scene.read_text().replace("1.5", "1.6"))
    assert main(arguments) == 2
    assert "changed since" in capfd.readouterr().err
    assert "1.6" in scene.read_text()
    other = tmp_path / "other"
    other.mkdir()
    (other / "thesis.txt").write_text("years of work")
    assert main([str(path), "--output", str(other)]) == 2
    assert "holds other files" in capfd.readouterr().err
    assert [p.name for p in other.iterdir()] == ["thesis.txt"]


def test_the_same_file_gives_the_same_bytes(path: Path, mitsuba: Any, tmp_path: Path) -> None:
    """What a resumed training run relies on."""
    texts = []
    for name in ("a", "b"):
        import_lamp(path, tmp_path / name, picture=False)
        texts.append({p.relative_to(tmp_path / name): p.read_bytes()
                      for p in (tmp_path / name).rglob("*") if p.is_file()})  # fmt: skip
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("name", "title", "expected"),
    [
        ("pendant.glb", "", "pendant"), ("scene.glb", "Moon Lamp", "Moon_Lamp"),
        ("pendant.glb", "Scene", "pendant"), ("scene.glb", "", "workshop"),
        ("pendant.glb", "Sketchfab_Scene", "pendant"), ("models/lamp.glb", "", "lamp"),
    ],
)  # fmt: skip
def test_a_lamp_is_named_after_its_scene(
    name: str, title: str, expected: str, mitsuba: Any, tmp_path: Path
) -> None:
    made = glb.of([model.bulb()])
    if title:
        made.json["scenes"][0]["name"] = title
    path = tmp_path / "workshop" / name
    path.parent.mkdir(parents=True)
    scene = import_lamp(made.write(path), tmp_path / "out", picture=False).scene
    assert scene.name == f"{expected}.xml"


def test_usd_and_blender_titles(mitsuba: Any, tmp_path: Path) -> None:
    stage = usd.write(tmp_path, [model.bulb()], "scene.usda")
    assert import_lamp(stage, tmp_path / "out", picture=False).scene.stem == "ShelfLight"


def test_very_many_parts_become_few(mitsuba: Any, tmp_path: Path) -> None:
    made = glb.of([model.bulb(), model.base()])
    for k in range(500):
        made.node(name=f"Bead {k}", mesh=1, translation=[0.2 * (k % 20), 0.2 * (k // 20), 1])
    imported = import_lamp(made.write(tmp_path / "beads.glb"), tmp_path / "out", picture=False)
    assert len(imported.parts) == 2
    assert sum(row["triangles"] for row in imported.parts) == 1280 + 12 * 501
    assert any("joined" in note for note in imported.notes)


def test_names_of_all_kinds(mitsuba: Any, tmp_path: Path) -> None:
    """Names that are no file names, no XML, or steer a terminal."""
    names = ["../../etc/passwd", "a<b>&\"'", "--", "\x1b[31mred", "ünïcödé 灯", "", " " * 90, "CON",
             "x" * 300, "Bulb", "bulb", "Bulb_$Fbx$_Geometric", "$", "Half\ud83d"]  # fmt: skip
    pieces = [
        Piece(name, model.box((0.01,) * 3, (0.05 * k, 0, 0)), f"m{name}", model.base().words)
        for k, name in enumerate(names)
    ]
    source = glb.write(tmp_path, [*pieces, model.bulb()], "-- --.glb")
    made = import_lamp(source, tmp_path / "out", Options(name='a"<b>--&'), picture=False)
    assert len(made.parts) == len(names) + 1
    assert len({row["name"].lower() for row in made.parts}) == len(names) + 1
    scene = mitsuba.load_file(str(made.scene), optimize=False)
    assert len(scene.shapes()) == len(names) + 1
    written = [p for p in (tmp_path / "out").rglob("*") if p.is_file()]
    assert all(p.resolve().is_relative_to(tmp_path / "out") for p in written)
    assert "\x1b" not in (tmp_path / "out" / "parts.txt").read_text()


@pytest.mark.parametrize("kind", ["glb", "obj", "usda", "xml"])
def test_every_format_by_the_command(
    kind: str, mitsuba: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = {"glb": glb.write, "obj": obj.write, "usda": usd.write, "xml": writers}[kind](
        tmp_path, model.lamp()
    )
    assert main([str(source), "--output", str(tmp_path / "out"), "--no-picture"]) == 0
    out, err = capfd.readouterr()
    assert "Globe" in out
    assert "Traceback" not in err


def writers(folder: Path, pieces: list[Piece]) -> Path:
    return mitsuba.write(folder, pieces, "0.6.0")
