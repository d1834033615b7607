"""Commands of the benchmarks at their smallest, each; and asked for what is not there.

What they measure here says nothing: that they still run with the code beside them does.
"""

from __future__ import annotations

import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.trained import prepare

ROOT = Path(__file__).parents[3]
COMMANDS = {
    "checks": "benchmarks --reuse RUN --size 16 --paths 65536 --output OUTPUT --checks "
    "appearance hosts transmittance",
    "compile_cost": "benchmarks.compile_cost --only Sin",
    "closed_room": "benchmarks.closed_room --bundle BUNDLE --lamp SCENE --output OUTPUT "
    "--mountings wall --paths 65536 --spp 2",
    "fast_mode": "benchmarks.fast_mode --lamp BUNDLE --output OUTPUT --places floor --spp 2 "
    "--passes 3",
    "lamp_choice": "benchmarks.lamp_choice --lamp BUNDLE --counts 1 3 --passes 2 --spp 2",
    "many_lamps": "benchmarks.many_lamps ASSET --count 5",
    "operator_cost": "benchmarks.operator_cost --only Sin",
    "ray_files": "benchmarks.ray_files --rays 20000 --preset sketch --output OUTPUT",
    "rendering": "benchmarks.rendering --lamp BUNDLE --output OUTPUT --size 16 16 --spp 2",
    "routes": "benchmarks.routes --preset sketch --lamps frosted_globe --size 16 --paths 65536 "
    "--variants photons-straight --output OUTPUT",
    "shaders": "benchmarks.shaders BUNDLE",
    "validation": "benchmarks.validation --megabytes 2",
    "verdict": "benchmarks.verdict DEMO --paths 65536 --spp 16 --output OUTPUT",
    "worst_bundles": "benchmarks.worst_bundles --only doubled",
}
WRONG = {
    "benchmarks.cycles": "--bundle gone.plux --spp 0",
    "benchmarks.closed_room": "--bundle gone.plux --lamp gone.xml --path-spp -1",
    "benchmarks.lamp_choice": "--lamp gone.plux --passes 1",
    "benchmarks.roulette": "NO_SENSOR --spp 1 --passes 2",
    "benchmarks.routes": "--lamps no_such_lamp",
    "benchmarks.systems": "--workers -1",
    "benchmarks.validation": "--megabytes nan",
    "benchmarks.zoo": "--seed -1",
}
MISSING = {name: words for name, words in COMMANDS.items() if "BUNDLE" in words}


def modules() -> list[str]:
    """The benchmarks that read a command line."""
    found = [p for p in (ROOT / "benchmarks").rglob("*.py") if "command.Parser(" in p.read_text()]
    names = [".".join(p.relative_to(ROOT).with_suffix("").parts) for p in found]
    return sorted(name.removesuffix(".__main__") for name in names)


def run(words: str, **names: Path) -> subprocess.CompletedProcess[str]:
    for name, path in names.items():
        words = words.replace(name, str(path))
    command = [sys.executable, "-m", *words.split()]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A lamp of the smallest preset; its scene, run and bundle in `demo`, as the demo has them."""
    folder = tmp_path_factory.mktemp("lamps")
    subject = prepare("frosted_globe", folder, "sketch", "photons", threads=2)
    demo = folder / "demo"
    demo.mkdir()
    for name, made in {
        "lamp": subject.scene.parent, "run": subject.run, "lamp.plux": subject.bundle,
    }.items():  # fmt: skip
        (demo / name).symlink_to(made)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_it_runs(name: str, folder: Path, tmp_path: Path) -> None:
    bundle = folder / "frosted_globe-sketch-photons.plux"
    done = run(
        COMMANDS[name], OUTPUT=tmp_path, BUNDLE=bundle, ASSET=bundle.with_suffix(".usda"),
        SCENE=folder / "lamps/frosted_globe.xml", RUN=bundle.with_suffix(""), DEMO=folder / "demo",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "nan" not in done.stdout.lower().split()


@pytest.mark.slow
@pytest.mark.parametrize("name", MISSING)
def test_a_missing_lamp_is_a_line(name: str, tmp_path: Path) -> None:
    gone = tmp_path / "gone"
    done = run(MISSING[name], OUTPUT=tmp_path, BUNDLE=gone / "a.plux", SCENE=gone / "a.xml")
    assert done.returncode == 2, done.stderr[-2000:]
    assert "Traceback" not in done.stderr
    assert "a.plux" in done.stderr or "a.xml" in done.stderr


@pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")
@pytest.mark.parametrize("name", modules())
def test_an_unknown_option_is_a_line(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert called(name, ["--no-such-option"], monkeypatch) == 2
    assert one_line(capsys).startswith(f"python -m {name}: error:")


@pytest.mark.filterwarnings("ignore:.*found in sys.modules:RuntimeWarning")
@pytest.mark.parametrize("name", WRONG)
def test_what_it_cannot_do_is_a_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "dark.xml"
    scene.write_text('<scene version="3.0.0"><shape type="sphere"/></scene>')
    words = WRONG[name].replace("NO_SENSOR", str(scene)).split()
    assert called(name, words, monkeypatch) == 2
    assert f"{name}: error:" in one_line(capsys)


def called(name: str, words: list[str], monkeypatch: pytest.MonkeyPatch) -> object:
    """The exit code of `python -m name`."""
    monkeypatch.setattr(sys, "argv", [name, *words])
    with pytest.raises(SystemExit) as ended:
        runpy.run_module(name, run_name="__main__", alter_sys=False)
    return ended.value.code


def one_line(capsys: pytest.CaptureFixture[str]) -> str:
    """What a command said of its fault."""
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1, lines
    return lines[0]
