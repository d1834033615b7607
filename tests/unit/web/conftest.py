"""Node.js, the page's packages, Chromium, and the files that the tests in JavaScript read."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.unit.web import files

ROOT = Path(__file__).parents[3]
WEB = ROOT / "web"
PAGE = ROOT / "runtimes/onnx/purelight_onnx/page.html"
OLDEST = 20
Run = Callable[..., str]


@pytest.fixture(scope="session")
def node() -> str:
    """Node.js, where it and the packages of the page are installed."""
    program = shutil.which("node")
    if program is None:
        pytest.skip("Node.js is not installed")
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True)
    if int(version.stdout.lstrip("v").split(".")[0]) < OLDEST:
        pytest.skip(f"Node.js {version.stdout.strip()} is older than {OLDEST}")
    if not (WEB / "node_modules/three").is_dir():
        pytest.skip("the packages of web/ are not installed: make test-web installs them")
    return program


@pytest.fixture(scope="session")
def chromium() -> str:
    """Chromium, which the tests run without a window and without a network."""
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next(filter(None, map(shutil.which, names)), None)
    if found is None:
        pytest.skip(f"none of {', '.join(names)} is installed")
    return found


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What Python says of lamps, damaged files and networks."""
    path = tmp_path_factory.mktemp("web")
    files.write(path)
    return path


@pytest.fixture
def run(node: str) -> Run:
    """Runs Node.js in web/ and gives what it prints; fails where it fails."""

    def start(*arguments: str, **variables: str) -> str:
        done = subprocess.run(
            [node, *arguments], check=False, cwd=WEB, capture_output=True, text=True,
            env={**os.environ, **variables}, timeout=3000,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return start


def passed(output: str) -> int:
    """How many tests of Node.js have passed, none of which was skipped by itself."""
    counts = dict(line[2:].split() for line in output.splitlines() if line.startswith("# pass"))
    return int(counts.get("pass", 0))
