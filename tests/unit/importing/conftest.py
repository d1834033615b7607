"""Fixtures of the importing tests: Mitsuba, and commands as a person runs them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from purelight_import.cli import main


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    from purelight_mitsuba import platform

    return platform.use("llvm_ad_rgb")


@pytest.fixture
def fault(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """The one line that an import ends with, with nothing left behind."""

    def run(path: Path, *options: str) -> str:
        output = tmp_path / "out"
        assert main([str(path), "--output", str(output), *options]) == 2
        out, err = capfd.readouterr()
        lines = err.splitlines()
        assert out == ""
        assert len(lines) == 1, err
        assert lines[0].startswith("purelight-import: error: ")
        assert not output.exists()
        assert not list(tmp_path.glob(".*"))
        return lines[0]

    return run
