"""Reading and checking a bundle needs NumPy alone; a missing package is one line."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from collections.abc import Callable

import numpy as np
import pytest

import purelight_format
from purelight_format import usd_schema
from purelight_format.errors import PureLightError
from purelight_format.srgb import png

HEAVY = ("torch", "mitsuba", "onnxruntime", "pxr", "onnx", "scipy", "PIL")
MODULES = [
    info.name for info in pkgutil.walk_packages(purelight_format.__path__, "purelight_format.")
]


def loaded(statement: str) -> set[str]:
    """Which heavy packages a fresh process has loaded after a statement."""
    script = f"{statement}\nimport sys\nprint(*set({HEAVY!r}).intersection(sys.modules))"
    command = [sys.executable, "-c", script]
    return set(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())


def test_importing_every_module_loads_no_heavy_package() -> None:
    assert "purelight_format.validation.validate" in MODULES
    assert loaded("\n".join(f"import {name}" for name in MODULES)) == set()


@pytest.mark.parametrize(
    ("package", "extra", "action"),
    [
        ("pxr", "purelight[usd]", usd_schema.register),
        ("PIL", "purelight[onnx]", lambda: png(np.zeros((1, 1, 3)))),
    ],
)
def test_a_missing_package_is_one_clear_line(
    package: str, extra: str, action: Callable[[], object], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(PureLightError) as caught:
        action()
    assert extra in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("package", ["onnx", "pxr", "PIL.Image"])
def test_the_check_can_fail(package: str) -> None:
    assert package.partition(".")[0] in loaded(f"import {package}")
