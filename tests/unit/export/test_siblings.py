"""An export replaces its own files and nobody else's."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from pxr import Usd

from purelight_export import cli
from purelight_export.export import export
from purelight_format.usd.luminaires import luminaires
from purelight_format.validation.validate import validate
from purelight_train.runs.run_directory import RunDirectory

KEPT = '<scene version="3.0.0"><shape type="sphere" id="base"/></scene>'
ROOM = '#usda 1.0\ndef Xform "Room" { def "Lamp" ( references = @./lamp.usda@ ) {} }\n'
THEIRS = {
    "lamp.usda": ROOM, "lamp.ies": "IES:LM-63-2019\n[MANUFAC] Lights of PureLight\nTILT=NONE\n",
    "lamp.ldt": "Maker\n1\n", "lamp.kept.xml": KEPT, "lamp.kept/base.ply": "ply\n",
    "lamp.shape.ies": "",
}  # fmt: skip


@pytest.fixture(scope="module")
def run(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with parts that were kept apart."""
    found = shutil.copytree(run_directory, tmp_path_factory.mktemp("kept") / "run")
    (found / "kept").mkdir()
    (found / "kept" / "kept.xml").write_text(KEPT)
    return found


@pytest.mark.parametrize("name", THEIRS)
def test_a_file_of_someone_else_is_refused_before_any_work(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setattr(RunDirectory, "open", lambda path: pytest.fail("work has begun"))
    theirs = tmp_path / name
    theirs.parent.mkdir(exist_ok=True)
    theirs.write_text(THEIRS[name])
    words = [str(run), "--output", str(tmp_path / "lamp.plux"), "--photometry", "ies,ldt"]
    assert cli.main(words) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert "would be replaced" in error
    assert "--output" in error
    assert theirs.read_text() == THEIRS[name]
    assert not (tmp_path / "lamp.plux").exists()


def test_what_will_not_be_written_may_stand_there(run_directory: Path, tmp_path: Path) -> None:
    for name in ("lamp.ldt", "lamp.kept.xml"):
        (tmp_path / name).write_text(THEIRS[name])
    export(run_directory, tmp_path / "lamp.plux", networks=["appearance"])
    assert (tmp_path / "lamp.ldt").read_text() == THEIRS["lamp.ldt"]


def test_own_files_are_replaced(run: Path, tmp_path: Path) -> None:
    for name in ("Old", "New"):
        written = export(
            run, tmp_path / "lamp.plux", name=name, networks=["appearance"],
            photometry=("ies", "ldt"),
        )  # fmt: skip
    assert {path.name for path in written} == {"lamp.plux"} | {n for n in THEIRS if "/" not in n}
    assert b"[LUMINAIRE] New" in (tmp_path / "lamp.ies").read_bytes()


def test_the_date_is_what_is_asked_for(run: Path, tmp_path: Path) -> None:
    """Or the day of the run: the bytes are never those of the clock."""
    for day in ("2001-02-03", None):
        paths = [tmp_path / f"{day}-{k}.plux" for k in range(2)]
        for path in paths:
            export(run, path, name="lamp", networks=["appearance"], issued=day)
        first, second = (path.with_suffix(".ies").read_text() for path in paths)
        assert first == second
        assert ("[ISSUEDATE] 2001-02-03" in first) == (day is not None)


@pytest.mark.parametrize("name", ["lamp@2x", "lamp [1]", "a:b", "a\\b", "a\nb"])
def test_a_name_that_no_usd_layer_can_say_is_refused_before_any_work(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.setattr(RunDirectory, "open", lambda path: pytest.fail("work has begun"))
    assert cli.main([str(run), "--output", str(tmp_path / f"{name}.plux")]) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert "USD" in error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["Größe 灯", 'it\'s "q" #1', "50%<UDIM>{v}", "-x"])
def test_any_other_name_is_one_that_usd_opens(run: Path, tmp_path: Path, name: str) -> None:
    export(run, tmp_path / f"{name}.plux", name=name, networks=["appearance"])
    assert not validate(tmp_path / f"{name}.plux").issues
    (found,) = luminaires(Usd.Stage.Open(str(tmp_path / f"{name}.usda")))
    assert Path(found.bundle) == tmp_path / f"{name}.plux"


def test_files_that_an_export_leaves_old_are_told(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [str(run), "--output", str(tmp_path / "lamp.plux"), "--networks", "appearance"]
    assert cli.main([*words, "--photometry", "ies,ldt"]) == 0
    assert "warning" not in capsys.readouterr().err
    assert cli.main(words) == 0
    (line,) = (line for line in capsys.readouterr().err.splitlines() if "warning" in line)
    assert "lamp.ldt: of an earlier export" in line
