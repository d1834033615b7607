"""Folders that hold packages are no packages themselves."""

from __future__ import annotations

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
]


@pytest.mark.parametrize("folder", FOLDERS)
def test_folder_would_not_shadow_a_library(folder: str) -> None:
    assert (ROOT / folder).is_dir()
    assert not (ROOT / folder / "__init__.py").exists()
