"""Reading a bundle needs NumPy alone until a network or a stage is opened."""

from __future__ import annotations

import pkgutil
import subprocess
import sys

import pytest

import purelight_format

HEAVY = ("torch", "mitsuba", "onnxruntime", "pxr", "onnx", "scipy")
MODULES = [
    info.name for info in pkgutil.walk_packages(purelight_format.__path__, "purelight_format.")
]


def loaded(statement: str) -> set[str]:
    """Which heavy packages a fresh process has loaded after a statement."""
    script = f"{statement}\nimport sys\nprint(*set({HEAVY!r}).intersection(sys.modules))"
    command = [sys.executable, "-c", script]
    return set(subprocess.run(command, check=True, capture_output=True, text=True).stdout.split())


def test_importing_every_module_loads_no_heavy_package() -> None:
    assert "purelight_format.validate" in MODULES
    assert loaded("\n".join(f"import {name}" for name in MODULES)) == set()


@pytest.mark.parametrize("package", ["onnx", "pxr"])
def test_the_check_can_fail(package: str) -> None:
    assert package in loaded(f"import {package}")
