"""`purelight-train` takes the same files, and tells its doubts before long work."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from purelight_train import cli
from purelight_train.presets import PRESETS
from tests.support import tiny
from tests.support.lamp_files import glb, mitsuba, model


@pytest.fixture
def train(mitsuba: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.setitem(PRESETS, "draft", tiny.TINY)

    def run(*arguments: str) -> int:
        return cli.main([*arguments, "--device", "cpu", "--no-report", "--anchor", "none"])

    return run


@pytest.fixture
def stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Training ends where the tracing of light would begin."""
    from purelight_format.errors import PureLightError
    from purelight_train.light import luminaire

    def refuse(*_: Any, **__: Any) -> None:
        raise PureLightError("the work would begin here")

    monkeypatch.setattr(luminaire, "trace_records", refuse)


@pytest.mark.slow
def test_from_a_glb_to_a_bundle(
    train: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from purelight_export.cli import main as export
    from purelight_format.bundle import Bundle

    path, run = glb.write(tmp_path, model.lamp(), "moon_light.glb"), tmp_path / "run"
    options = ["--emitter", "Bulb=500lm,2700K"]
    assert train(str(path), "--output", str(run), *options) == 0
    assert json.loads((run / "config.json").read_text())["luminaire"].endswith(
        "lamp/moon_light.xml"
    )
    assert train(str(path), "--output", str(run), "--resume", *options) == 0
    capfd.readouterr()
    assert train(str(path), "--output", str(run), "--resume", "--lumens", "3") == 2
    assert "other options" in capfd.readouterr().err
    assert export([str(run), "--output", str(tmp_path / "lamp.plux")]) == 0
    written = Bundle.open(tmp_path / "lamp.plux")
    assert written.manifest.name == "moon_light"


def test_an_import_is_taken_again_by_the_same_words(mitsuba: Any, tmp_path: Path) -> None:
    """What `--resume` relies on; another file or other words are refused."""
    from purelight_format.errors import PureLightError
    from purelight_import import Options
    from purelight_train.foreign import scene_of

    path, run = glb.write(tmp_path, [model.bulb()], "moon_light.glb"), tmp_path / "run"
    options = Options(emitters=("Bulb=500lm,2700K",), lumens=500.0)
    with scene_of(path, run, options) as first:
        written = first.scene.stat().st_mtime_ns
    with scene_of(path, run, options) as second:
        assert second.scene.stat().st_mtime_ns == written
    with pytest.raises(PureLightError, match="other options"), scene_of(path, run, Options()):
        pass
    glb.write(tmp_path, model.lamp(), "moon_light.glb")
    with pytest.raises(PureLightError, match="another lamp"), scene_of(path, run, options):
        pass


@pytest.mark.usefixtures("stopped")
def test_an_import_that_comes_to_nothing_leaves_nothing(
    train: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path, run = glb.write(tmp_path, model.lamp()), tmp_path / "runs" / "one"
    assert train(str(path), "--output", str(run)) == 2
    assert "would begin" in capfd.readouterr().err
    assert not run.exists()
    assert train(str(path), "--output", str(run), "--omit", "Bulb") == 2
    assert "--emitter" in capfd.readouterr().err
    assert not (tmp_path / "runs").exists()


@pytest.mark.usefixtures("stopped")
def test_doubts_come_before_the_work(
    train: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a scene as it is, and of one that is brought in; each line once, and no Python in it."""
    pieces = [model.bulb(), model.globe(model.ball(0.06))]
    scene = mitsuba.write(tmp_path, pieces)
    for extra in ([], ["--name", "other"]):
        assert train(str(scene), "--output", str(tmp_path / "run"), *extra) == 2
        lines = [x for x in capfd.readouterr().err.splitlines() if "warning" in x]
        assert len(lines) == 1, lines
        assert lines[0].startswith("purelight-train: warning: emitter 'Bulb' stands in solid glass")


@pytest.mark.usefixtures("stopped")
def test_python_warnings_are_lines(
    train: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    made = model.shell()
    made.invert()
    scene = mitsuba.write(tmp_path, [model.bulb(), model.globe(made)])
    assert train(str(scene), "--output", str(tmp_path / "run")) == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if "inside out" in line]
    assert len(lines) == 1
    assert lines[0].startswith("purelight-train: warning: glass 'Globe' is inside out")


@pytest.mark.parametrize("name", ["lamp.fbx", "lamp"])
def test_other_files_are_one_line(
    name: str, train: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(b"")
    assert train(str(tmp_path / name), "--output", str(tmp_path / "run")) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert "is not read; give a lamp as glTF" in line
    assert not (tmp_path / "run").exists()


def test_flipped_meshes_of_one_glass_load(mitsuba: Any, tmp_path: Path) -> None:
    """Which Mitsuba's own joining of meshes fails at."""
    from purelight_train.light.luminaire import load_luminaire

    flip = '<boolean name="flip_normals" value="true"/>'
    cubes = "".join(
        f'<shape type="cube"><transform name="to_world"><scale value="{size}"/></transform>{more}'
        '<ref id="glass"/></shape>'
        for size, more in ((0.5, ""), (0.45, flip))
    )
    bulb = '<shape type="sphere"><float name="radius" value="0.1"/><emitter type="area"/></shape>'
    glass = '<bsdf type="dielectric" id="glass"/>'
    path = tmp_path / "lamp.xml"
    path.write_text(f'<scene version="3.0.0">{glass}{bulb}{cubes}</scene>')
    assert len(load_luminaire(path).scene.shapes()) == 3
