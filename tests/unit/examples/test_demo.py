"""The demo's command and its stages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from purelight_examples import cli
from purelight_examples.demo import LAMPS, VIEWED_BY, Demo, command
from purelight_examples.stages import input_digest
from purelight_format.errors import PureLightError


def digests(demo: Demo) -> dict[str, str]:
    found, digest = {}, ""
    for stage in demo.stages():
        digest = found[stage.name] = input_digest(digest, stage)
    return found


def test_an_output_that_is_a_file_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "taken"
    file.write_text("x")
    assert cli.main(["--output", str(file)]) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("purelight-demo: error:")
    assert "\n" not in error
    assert file.read_text() == "x"


def test_other_pictures_keep_the_training(tmp_path: Path) -> None:
    demo = Demo(tmp_path)
    before, after = digests(demo), digests(replace(demo, reference_seconds=1.0))
    assert before["train"] == after["train"]
    assert before["export"] == after["export"]
    assert before["reference"] != after["reference"]
    assert before["report"] != after["report"]


def test_another_lamp_trains_again(tmp_path: Path) -> None:
    demo = Demo(tmp_path)
    assert digests(demo)["train"] != digests(replace(demo, lamp="crystal"))["train"]


def test_the_command_offers_every_lamp() -> None:
    assert set(cli.LAMPS) == set(LAMPS) == set(VIEWED_BY)


def test_a_command_that_fails_stops_the_demo() -> None:
    with pytest.raises(PureLightError, match="purelight-train stopped with exit code 2"):
        command("purelight-train", lambda arguments: 2, [])
