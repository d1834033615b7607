"""Folders that hold packages are no packages themselves; tests stand on their own."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
FOLDERS = [
    "training",
    "exporters",
    "examples",
    "runtimes",
    "runtimes/mitsuba",
    "runtimes/onnx",
    "runtimes/cpp",
    "integrations",
    "integrations/blender",
]


@pytest.mark.parametrize("folder", FOLDERS)
def test_folder_would_not_shadow_a_library(folder: str) -> None:
    assert (ROOT / folder).is_dir()
    assert not (ROOT / folder / "__init__.py").exists()


def test_only_tests_of_benchmarks_import_them_and_none_changes_the_path() -> None:
    forbidden = re.compile(r"^ *(?:from|import) benchmarks\b|sys\.path\.", re.MULTILINE)
    tests = set((ROOT / "tests").rglob("*.py"))
    benchmarks = {path for path in tests if path.parent.name == "benchmarks" or "zoo" in path.name}
    blender = {ROOT / "tests/support/osl_picture.py"}  # Run by Blender's own Python
    assert not [p for p in tests - benchmarks - blender if forbidden.search(p.read_text())]
    assert [path for path in benchmarks if forbidden.search(path.read_text())]
