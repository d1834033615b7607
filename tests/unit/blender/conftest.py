"""Blender with the extension installed from its zip, where there is a Python with `bpy`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from purelight_blender import packing
from tests.support import osl_picture
from tests.support.blender_host import Blender


@pytest.fixture(scope="session")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("zip") / "purelight.zip"
    assert packing.main(["--output", str(path)]) == 0
    return path


@pytest.fixture(scope="session")
def blender(archive: Path, tmp_path_factory: pytest.TempPathFactory) -> Blender:
    program = osl_picture.python()
    if program is None:
        pytest.skip(f"no Python with bpy: name one in {osl_picture.VARIABLE}, or make test-blender")
    found = Blender(program, tmp_path_factory.mktemp("blender"))
    (loaded,) = found.run(("install", {"path": str(archive)}), installed=False)
    assert loaded == []  # No library that Blender has not.
    return found


def pixels(path: Path) -> Any:
    """A picture [height, width, 3]."""
    import OpenEXR

    with OpenEXR.File(str(path)) as file:
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    return next(iter(channels.values()))[..., :3]
