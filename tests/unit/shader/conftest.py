"""A small lamp with every network, as a bundle on the disk."""

from __future__ import annotations

from pathlib import Path

import pytest

from purelight_format import bundle
from purelight_format.bundle import Bundle
from tests.support import lamp


@pytest.fixture(scope="session")
def octahedron(tmp_path_factory: pytest.TempPathFactory) -> Bundle:
    return bundle.write(tmp_path_factory.mktemp("lamp") / "lamp.plux", *lamp.parts())


@pytest.fixture
def alone(tmp_path: Path) -> Bundle:
    """The smallest bundle: a lamp of one network."""
    path = Path(__file__).parents[3] / "spec/example.plux"
    return Bundle.open(path)
