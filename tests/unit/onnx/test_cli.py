"""The command `purelight-view`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import OpenEXR
import pytest
from PIL import Image

from purelight_onnx import cli
from purelight_onnx.luminaire import Luminaire


@pytest.fixture
def opened(bundle: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets the command open the bundle in memory, whatever its path."""
    lamp = Luminaire(bundle)
    monkeypatch.setattr(Luminaire, "open", lambda path, **options: lamp)


@pytest.mark.usefixtures("opened")
def test_a_picture_and_its_preview_are_written(tmp_path: Path) -> None:
    output = tmp_path / "new" / "view.exr"
    arguments = ["--size", "24", "--spp", "1", "--background", "1", "0", "0"]
    assert cli.main(["lamp.plux", "--output", str(output), *arguments]) == 0
    with OpenEXR.File(str(output)) as file:
        pixels = file.channels()["RGB"].pixels
    assert pixels.shape == (24, 24, 3)
    assert pixels[0, 0].tolist() == [1, 0, 0]
    assert Image.open(output.with_suffix(".png")).size == (24, 24)


@pytest.mark.usefixtures("opened")
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--output", "view.png"], ".exr"),
        (["--output", "view.exr", "--size", "0"], "size"),
        (["--output", "view.exr", "--distance", "nan"], "distance"),
        (["--output", "view.exr", "--spp", "0"], "--spp"),
        (["--output", "view.exr", "--seed", "-1"], "--seed"),
        (["--output", "view.exr", "--background", "nan", "0", "0"], "--background"),
        (["--output", "view.exr", "--background", "0", "1e39", "0"], "--background"),
        (["--output", "view.exr", "--background", "0", "0", "-1"], "--background"),
        (["--output", "view.exr", "--exposure", "1e9"], "--exposure"),
        (["--output", "view.exr", "--exposure", "nan"], "--exposure"),
        (["--output", "view.exr", "--azimuth", "inf"], "--azimuth"),
        (["--output", "/dev/null/view.exr", "--size", "4"], "cannot write"),
    ],
)
def test_faults_of_the_user_are_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["lamp.plux", *arguments]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("purelight-view: error: ")
    assert message in error
    assert not list(tmp_path.iterdir())


@pytest.mark.usefixtures("opened")
def test_no_picture_is_written_where_its_preview_cannot_be(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "view.png").mkdir()
    assert cli.main(["lamp.plux", "--output", str(tmp_path / "view.exr"), "--size", "4"]) == 2
    assert "view.png: not a regular file" in capsys.readouterr().err
    assert not (tmp_path / "view.exr").exists()


def test_a_missing_bundle_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = str(tmp_path / "view.exr")
    assert cli.main([str(tmp_path / "lamp.plux"), "--output", output]) == 2
    (error,) = capsys.readouterr().err.strip().splitlines()
    assert "lamp.plux" in error
