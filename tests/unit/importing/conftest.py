"""Fixtures of the importing tests: Mitsuba, and commands as a person runs them."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from purelight_format.errors import PureLightError
from purelight_import.cli import main
from purelight_import.read import isolated


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    from purelight_mitsuba import platform

    return platform.use("llvm_ad_rgb")


@pytest.fixture
def at_once(mitsuba: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets all readers work in this process, which is faster, and keeps Mitsuba's variant."""

    def call(function: str, path: Path) -> Any:
        module, _, name = function.partition(":")
        before = mitsuba.variant()
        try:
            return getattr(importlib.import_module(module), name)(path)
        except PureLightError:
            raise
        except Exception as error:
            raise ValueError(str(error)) from error
        finally:
            mitsuba.set_variant(before)

    monkeypatch.setattr(isolated, "call", call)


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
