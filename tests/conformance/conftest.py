"""Mitsuba's variant, and the suite, made once for all tests."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_conformance import maker, suite
from purelight_conformance.suite import Suite
from purelight_mitsuba import use

use()


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("suite")
    maker.make(path)
    return path


@pytest.fixture(scope="session")
def whole(folder: Path) -> Suite:
    """The suite as it is read back."""
    return suite.read(folder)
