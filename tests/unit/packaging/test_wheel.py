"""The wheel: built from the tree, it works by itself in an empty folder."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PACKAGES = ["format", "conformance", "train", "import", "export", "onnx", "mitsuba", "examples"]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel unpacked into it, without its dependencies."""
    folder = tmp_path_factory.mktemp("wheel")
    build = ["build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    run(folder, "-m", *build)
    wheel = next(folder.glob("*.whl"))
    install = ["pip", "install", "--quiet", "--no-deps", "--no-index", "--target", "site", wheel]
    run(folder, "-m", *map(str, install))
    return folder / "site"


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python from `folder`, where the working tree is not on the path."""
    result = subprocess.run(
        [sys.executable, *arguments],
        check=False,
        cwd=folder,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": "site", "PYTHONDONTWRITEBYTECODE": "1"},
        timeout=120,
    )
    assert result.returncode in (0, 2), result.stderr
    return result


@pytest.mark.parametrize("name", PACKAGES)
def test_wheel_holds_every_package(installed: Path, name: str) -> None:
    code = f"import purelight_{name} as package; print(package.__file__)"
    found = Path(run(installed.parent, "-c", code).stdout.strip())
    assert found.is_relative_to(installed)


def test_the_page_for_browsers_is_in_the_wheel(installed: Path) -> None:
    assert (installed / "purelight_onnx/page.html").stat().st_size > 1 << 18


def test_validate_command_explains_a_missing_file(installed: Path) -> None:
    code = "import sys; from purelight_format.cli import validate_main as main; sys.exit(main())"
    result = run(installed.parent, "-c", code, "missing.plux")
    assert result.returncode == 2
    assert "missing.plux" in result.stderr
    assert "Traceback" not in result.stderr


def test_commands_are_installed(installed: Path) -> None:
    commands = {path.name for path in (installed / "bin").iterdir()}
    family = ("train", "export", "validate", "inspect", "conformance", "render", "view", "demo")
    assert {f"purelight-{name}" for name in family} <= commands
