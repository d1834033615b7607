"""Fixtures of the training tests: Mitsuba, and the smallest lamp that has every part."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import torch

from tests.support import tiny


@pytest.fixture(scope="session")
def mitsuba() -> Any:
    from purelight_mitsuba import platform

    torch.set_num_threads(2)
    return platform.use("llvm_ad_rgb")


@pytest.fixture(scope="session")
def lamp(mitsuba: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tiny.write(tmp_path_factory.mktemp("lamp"))
