"""Who follows docs/add_a_network.md gets a lamp that tells how far it is."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs/add_a_network.md"
PACKAGES = ("", "conformance", "training", "exporters", "runtimes/onnx", "runtimes/mitsuba")
COPIED = ("purelight_format", *PACKAGES[1:], "spec", "tests")
BLOCK = re.compile(r'^```(\w+) title="(.+?)"\n(.*?)^```$', re.M | re.S)
SNIPPET = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)


def blocks() -> list[tuple[str, str, str]]:
    """Of the page: whether it is a `diff`, which file it is of, and its text."""
    return BLOCK.findall(PAGE.read_text())


def apply(language: str, file: Path, text: str) -> None:
    """Does what a block says, to the letter."""
    if language != "diff":
        assert not file.exists()
        file.write_text(text)
        return
    for part in text.split("…\n"):
        lines = part.splitlines(keepends=True)
        before = "".join(line[1:] for line in lines if line[0] in " -")
        after = "".join(line[1:] for line in lines if line[0] in " +")
        content = file.read_text()
        assert content.count(before) == 1, f"{file}: not found once:\n{before}"
        file.write_text(content.replace(before, after))


@pytest.fixture(scope="module")
def changed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the code with what the page adds."""
    folder = tmp_path_factory.mktemp("copy")
    for name in COPIED:
        shutil.copytree(
            ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "node")
        )
    for language, name, text in blocks():
        apply(language, folder / name, text)
    return folder


def run(changed: Path, *arguments: str, where: Path) -> str:
    """Runs Python with the changed code."""
    path = os.pathsep.join(str(changed / package) for package in PACKAGES)
    done = subprocess.run(
        [sys.executable, *arguments], cwd=where, env={**os.environ, "PYTHONPATH": path},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_four_files_and_one_document() -> None:
    files = [Path(name) for _, name, _ in blocks()]
    assert len(files) == len(set(files))
    assert sum(file.suffix == ".py" for file in files) <= 4
    assert sum(file.suffix != ".py" for file in files) <= 1


def test_a_lamp_tells_its_depth(changed: Path, tmp_path: Path) -> None:
    script = Path(__file__).with_name("depth_lamp.py")
    found = json.loads(run(changed, str(script), where=tmp_path).splitlines()[-1])
    assert found["code"].startswith(str(changed))
    assert found["issues"] == []
    assert found["conforms"]
    assert found["networks"][-1] == "depth"
    # The bounding sphere itself is 0.41 radii off in the mean
    assert found["error"] < 0.08
    assert found["error"] < 0.2 * found["error_of_sphere"]
    assert found["passing"] < 0.15
    assert found["missing"] == 0
    (snippet,) = SNIPPET.findall(PAGE.read_text())
    assert re.match(r"The lamp hangs 0\.\d+ m above", run(changed, "-c", snippet, where=tmp_path))
    inspect = "import sys; from purelight_format.cli import inspect_main; sys.exit(inspect_main())"
    assert "tell how far it is" in run(changed, "-c", inspect, "lamp.plux", where=tmp_path)


def test_the_document_is_what_the_declarations_ask_for(changed: Path) -> None:
    test = "tests/unit/format/test_spec.py::test_the_networks_are_those_of_the_table"
    run(changed, "-m", "pytest", "-q", "-p", "no:cacheprovider", test, where=changed)
