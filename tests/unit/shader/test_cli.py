"""`purelight-shader` as its user sees it."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_format.bundle import Bundle
from purelight_shader.cli import main


def said(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line about a fault."""
    assert main(words) == 2
    out, err = capsys.readouterr()
    (line,) = err.splitlines()
    assert out == ""
    assert line.startswith("purelight-shader: error: ")
    return line


def test_it_names_what_it_wrote(
    octahedron: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    words = [str(octahedron.path), "--language", "slang", "--output", str(folder)]
    assert main(words) == 0
    named = {line.split("  ")[0] for line in capsys.readouterr().out.splitlines()}
    assert named == {str(path) for path in folder.iterdir()}
    assert {"README.md", "lamp.json", "lamp.slang"} <= {path.name for path in folder.iterdir()}
    assert main(words) == 0  # Once more, over the same files.


def test_faults_are_one_line(
    octahedron: Bundle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rest = ("--language", "slang", "--output")
    assert "cannot read" in said(capsys, str(tmp_path / "no.plux"), *rest, str(tmp_path / "a"))
    spoilt = tmp_path / "spoilt.plux"
    spoilt.write_bytes(octahedron.data[:-1])
    assert "not a valid bundle" in said(capsys, str(spoilt), *rest, str(tmp_path / "b"))
    file = tmp_path / "file"
    file.write_text("")
    assert "name is that of a file" in said(capsys, str(octahedron.path), *rest, str(file))
    assert {path.name for path in tmp_path.iterdir()} == {"spoilt.plux", "file"}


@pytest.mark.parametrize(
    ("words", "fault"),
    [
        (["--language", "basic", "--output", "x"], "basic"),
        (["--language", "slang", "--output", "x", "--prefix", "a b"], "small letters"),
    ],
)
def test_wrong_arguments(
    words: list[str], fault: str, octahedron: Bundle, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as caught:
        main([str(octahedron.path), *words])
    assert caught.value.code == 2
    assert fault in capsys.readouterr().err
