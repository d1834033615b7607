"""Faults a user can cause: one line, exit code 2, nothing left behind."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from purelight_train import size_cli, threads
from purelight_train.cli import main

CASES = {
    "missing": (None, "no such file"),
    "not_xml": ("certainly not XML", "not a Mitsuba 3 scene"),
    "unknown_plugin": (
        '<scene version="3.0.0"><shape type="teapot"/></scene>',
        "not a Mitsuba 3 scene",
    ),
    "no_emitter": (
        '<scene version="3.0.0"><shape type="sphere"/></scene>',
        "no emitter",
    ),
    "sky": (
        '<scene version="3.0.0"><shape type="sphere"/><emitter type="constant"/></scene>',
        "shines from infinity",
    ),
    "one_direction": (
        '<scene version="3.0.0"><shape type="rectangle"><emitter type="directionalarea"/>'
        "</shape></scene>",
        "emitter 0 (it has no id) shines in one direction alone",
    ),
    "dark": (
        '<scene version="3.0.0"><shape type="sphere"><emitter type="area">'
        '<rgb name="radiance" value="0"/></emitter></shape></scene>',
        "emits nothing",
    ),
    "point_alone": (
        '<scene version="3.0.0"><emitter type="point"/></scene>',
        "no area",
    ),
    "no_size": (
        '<scene version="3.0.0"><shape type="sphere"><float name="radius" value="0"/>'
        '<emitter type="area"/></shape></scene>',
        "no area",
    ),
    "negative": (
        '<scene version="3.0.0"><shape type="sphere"><emitter type="area">'
        '<rgb name="radiance" value="-1, 1, 1"/></emitter></shape></scene>',
        "negative radiance",
    ),
    "endless": (
        '<scene version="3.0.0"><shape type="sphere"><emitter type="area"/></shape>'
        '<shape type="sphere"><emitter type="area" id="sun"><rgb name="radiance" '
        'value="inf, 1, 1"/></emitter></shape></scene>',
        "the radiance or the place of emitter 'sun' is not finite",
    ),
    "endless without a name": (
        '<scene version="3.0.0"><shape type="rectangle" id="lit"><emitter type="area">'
        '<rgb name="radiance" value="inf, 1, 1"/></emitter></shape></scene>',
        "emitter 'lit' is not finite",
    ),
    "blackbody": (
        '<scene version="3.0.0"><shape type="sphere"><emitter type="area"><spectrum '
        'name="radiance" type="blackbody"><float name="temperature" value="2700"/></spectrum>'
        "</emitter></shape></scene>",
        "no radiance in R, G and B",
    ),
    "atom": (
        '<scene version="3.0.0"><shape type="sphere"><float name="radius" value="1e-12"/>'
        '<emitter type="area"/></shape></scene>',
        "2e-12 m across",
    ),
    "off_the_origin": (
        '<scene version="3.0.0"><shape type="sphere"><point name="center" x="0" y="-200" z="0"/>'
        '<emitter type="area"/></shape></scene>',
        "move it to the origin",
    ),
    "far_away": (
        '<scene version="3.0.0"><shape type="sphere"><point name="center" x="1e7" y="0" z="0"/>'
        '<emitter type="area"/></shape></scene>',
        "move it to the origin",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_faulty_scene(
    case: str, mitsuba: Any, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    text, reason = CASES[case]
    scene, output = tmp_path / "lamp.xml", tmp_path / "run"
    if text is not None:
        scene.write_text(text)
    assert main([str(scene), "--output", str(output), "--device", "cpu"]) == 2
    error = [line for line in capfd.readouterr().err.splitlines() if "error:" in line]
    assert len(error) == 1
    assert error[0].startswith("purelight-train: error: ")
    assert reason in error[0]
    assert not output.exists()


def test_a_place_that_cannot_be_written_is_refused_before_any_work(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(threads, "use", lambda count: pytest.fail("work has begun"))
    (tmp_path / "file").touch()
    output = ["--output", str(tmp_path / "file" / "run")]
    assert main(["lamp.xml", *output]) == 2
    assert size_cli.main(["run", *output, "--target-error", "0.1"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 2
    assert all("cannot write" in line for line in lines)


@pytest.mark.parametrize(
    ("option", "value"),
    [("--seed", "-1"), ("--seed", str(1 << 32)), ("--seed", "x"), ("--threads", "0"),
     ("--threads", "-2"), ("--threads", "many")],
)  # fmt: skip
def test_numbers_that_cannot_be_are_refused_before_any_work(
    option: str, value: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They were tracebacks of NumPy and Torch, some of them after the light had been traced."""
    with pytest.raises(SystemExit) as end:
        main(["lamp.xml", "--output", str(tmp_path / "run"), option, value])
    assert end.value.code == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert f"{value}: give a whole number from" in lines[0]


def test_the_largest_seed_is_one_for_all(mitsuba: Any, tmp_path: Path) -> None:
    """Stages and steps are counted into it, and no generator of numbers takes all integers."""
    import torch

    from purelight_format import command
    from purelight_train.presets import DRAFT, Optimisation
    from purelight_train.runs.run_directory import RunDirectory
    from purelight_train.runs.stages import Stages

    stages = Stages(RunDirectory(tmp_path), command.SEEDS - 1, torch.device("cpu"), ())
    stages.rng("light").random()
    module = stages.build("any stage", lambda *_: torch.nn.Linear(1, 1), None, DRAFT)  # type: ignore[arg-type]
    one = torch.ones(1, 1)
    stages.train("x", module, lambda own: lambda _: own(one).square().mean(),
                 Optimisation(2, 1, 1e-2))  # fmt: skip
    assert (tmp_path / "networks" / "x.safetensors").is_file()
