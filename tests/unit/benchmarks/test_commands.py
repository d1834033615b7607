"""Commands of the benchmarks at their smallest, each; and asked for a lamp that is not there.

What they measure here says nothing: that they still run with the code beside them does.
"""

from __future__ import annotations

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
MISSING = {name: words for name, words in COMMANDS.items() if "BUNDLE" in words}


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
