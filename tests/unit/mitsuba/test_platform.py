"""Versions, LLVM and variants: each fault is one line with its remedy."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import drjit as dr
import numpy as np
import pytest

from purelight_format.errors import PureLightError
from purelight_mitsuba import platform
from purelight_onnx.picture import write_exr


@pytest.mark.parametrize(
    ("mitsuba", "drjit", "found"),
    [("3.8.0", "1.5.0", "mitsuba 3.8.0"), ("3.10.0", "1.5.0", "3.10.0"), ("3.9.1", "1.4", "1.4")],
)
def test_other_versions_are_refused(mitsuba: str, drjit: str, found: str) -> None:
    with pytest.raises(PureLightError, match=found):
        platform.check_versions(mitsuba, drjit)


def test_versions_are_compared_as_numbers() -> None:
    platform.check_versions("3.9.12", "1.5.3rc1")


@pytest.mark.parametrize(("version", "named"), [((15, 0, 6), "LLVM 15"), ((-1, -1, -1), "no LLVM")])
def test_unusable_llvm_is_explained(
    version: tuple[int, ...], named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Detail:
        llvm_version = staticmethod(lambda: version)

    monkeypatch.setattr(dr, "detail", Detail)
    with pytest.raises(PureLightError, match=named) as error:
        platform.check_llvm()
    assert platform.LLVM_VARIABLE in str(error.value) or "pip install" in str(error.value)
    assert "\n" not in str(error.value)


def test_unknown_variant_is_refused() -> None:
    with pytest.raises(PureLightError, match="llvm_ad_rgb"):
        platform.use("llvm_ad_spectral")


def test_a_chosen_llvm_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(platform.LLVM_VARIABLE, "mine.so")
    monkeypatch.delitem(sys.modules, "drjit")
    platform.prepare()
    assert platform.os.environ[platform.LLVM_VARIABLE] == "mine.so"


def test_llvm_of_the_package_is_found(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    library = tmp_path / "lib" / "libLLVM.so"
    library.parent.mkdir()
    library.touch()

    class File:
        name = "libLLVM.so"

        def locate(self) -> Path:
            return tmp_path / "site-packages" / ".." / "lib" / "libLLVM.so"

    (tmp_path / "site-packages").mkdir()
    monkeypatch.setattr(platform.sys, "platform", "linux")
    monkeypatch.setattr(platform.metadata, "files", lambda _: [File()])
    assert platform.find_llvm() == library


def run(script: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=60, check=False
    )


@pytest.mark.parametrize(
    "script",
    [
        "import purelight_mitsuba, mitsuba as mi; mi.set_variant('llvm_ad_rgb')",
        "from purelight_mitsuba import use; mi = use(); use()",
    ],
)
def test_plugins_are_there_once_a_variant_is_set(script: str) -> None:
    done = run(f"{script}; print(mi.load_dict({{'type': 'purelight', 'mode': 'fast'}}).mode)")
    assert done.stdout.strip() == "fast", done.stderr


def test_import_works_without_mitsuba() -> None:
    hide = "import sys; sys.modules['mitsuba'] = None; sys.modules['drjit'] = None;"
    done = run(
        f"{hide} import purelight_mitsuba as p\ntry: p.use()\nexcept Exception as e: print(e)"
    )
    assert "pip install" in done.stdout, done.stderr


def test_use_returns_mitsuba() -> None:
    mi: Any = platform.use()
    assert mi.variant() == "llvm_ad_rgb"


def test_exr_files_are_read_by_one_thread(tmp_path: Path) -> None:
    """Mitsuba alone waits forever: hence a process that can be ended."""
    picture = tmp_path / "light.exr"
    write_exr(picture, np.full((4, 4, 3), 0.25, np.float32))
    script = (
        "import sys; from purelight_mitsuba import platform; mi = platform.use()\n"
        "import drjit as dr; dr.set_thread_count(1)\n"
        "with platform.reading(): bitmap = mi.Bitmap(sys.argv[1])\n"
        "print(bitmap.size(), dr.thread_count())"
    )
    words = [sys.executable, "-c", script, str(picture)]
    said = subprocess.run(words, check=True, timeout=120, capture_output=True, text=True).stdout
    assert said.split("\n")[0] == "[4, 4] 1"
