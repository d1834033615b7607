"""The page: its reader in Node.js, its pictures in a headless Chromium, and how it is built.

`make test-web` installs what is needed; what is missing is said where it is skipped.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from purelight_onnx import irradiance
from purelight_onnx.luminaire import Luminaire
from tests.unit.web import files
from tests.unit.web.conftest import PAGE, WEB, Run, passed
from web import tables

WALL = np.array([0.76, 0.75, 0.73])  # Of web/src/page/room.js.
QUICK = "damaged file|page is opened from disk|example opens"


def test_what_is_shared_with_python_is_current() -> None:
    assert tables.PATH.read_text() == tables.module(), "run: python -m web.tables"


def test_the_lock_file_names_no_registry() -> None:
    packages = json.loads((WEB / "package-lock.json").read_text())["packages"]
    assert all("resolved" not in entry for entry in packages.values())
    assert all("integrity" in entry for name, entry in packages.items() if name)


def test_the_page_may_reach_no_network_and_run_nothing_else() -> None:
    text = PAGE.read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text)
    assert policy
    assert "default-src 'none'" in policy[1]
    assert "connect-src 'none'" in policy[1]
    assert "unsafe" not in policy[1]
    assert not re.search(r'(?:src|href)="(?:https?:)?//', text)
    assert PAGE.stat().st_size < 1 << 20


def test_the_page_is_what_the_build_gives(run: Run, tmp_path: Path) -> None:
    run("build.mjs", str(tmp_path / "page.html"))
    same = (tmp_path / "page.html").read_bytes() == PAGE.read_bytes()
    assert same, "run: make web"


def test_the_reader_says_what_python_says(run: Run, folder: Path) -> None:
    output = run("--test", "test/reader.test.mjs", PURELIGHT_FILES=str(folder))
    assert passed(output) == 5


@pytest.mark.slow
def test_the_reader_says_what_python_says_of_large_files(run: Run, tmp_path: Path) -> None:
    files.write(tmp_path, large=True)
    output = run("--test", "test/reader.test.mjs", PURELIGHT_FILES=str(tmp_path))
    assert passed(output) == 5


def test_the_networks_give_what_onnx_runtime_gives(run: Run, folder: Path) -> None:
    output = run("--test", "test/oracle.test.mjs", PURELIGHT_FILES=str(folder))
    assert passed(output) == 2


def test_the_page_opens_lamps_and_refuses_damaged_ones(
    run: Run, folder: Path, chromium: str
) -> None:
    arguments = ["--test", f"--test-name-pattern={QUICK}", "test/page.test.mjs"]
    output = run(*arguments, PURELIGHT_FILES=str(folder), CHROMIUM=chromium)
    assert passed(output) == 3


@pytest.mark.slow
def test_everything_the_page_can_do(run: Run, folder: Path, chromium: str) -> None:
    output = run("--test", "test/page.test.mjs", PURELIGHT_FILES=str(folder), CHROMIUM=chromium)
    assert passed(output) == 16


@pytest.mark.slow
def test_the_room_receives_the_irradiance_that_python_finds(
    run: Run, folder: Path, chromium: str
) -> None:
    path = folder / "good/wild.plux"
    rows = json.loads(run("test/room.mjs", str(PAGE), str(path), CHROMIUM=chromium))[::9]
    point, normal, light = (np.array([r[k] for r in rows]) for k in ("point", "normal", "light"))
    lamp = Luminaire.open(path)
    right = irradiance(lamp, point, normal, samples=4096) * WALL / np.pi
    assert len(rows) > 20
    np.testing.assert_allclose(light.sum(0), right.sum(0), rtol=0.06)
    np.testing.assert_allclose(light[:, 1:], right[:, 1:], rtol=0.25, atol=0.05 * right.max())
