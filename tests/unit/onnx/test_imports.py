"""What the runtime may load: a host has no use for a training framework."""

from __future__ import annotations

import subprocess
import sys

import pytest

FORBIDDEN = ("torch", "mitsuba", "drjit", "pxr", "purelight_train", "purelight_export")
MODULES = "purelight_onnx.cli, purelight_onnx.viewer, purelight_onnx.luminaire"


def loaded(imports: str) -> list[str]:
    code = f"import sys, {imports}; print(*sorted(m for m in {FORBIDDEN} if m in sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return done.stdout.split()


def test_the_runtime_loads_no_training_framework() -> None:
    assert loaded(MODULES) == []


@pytest.mark.parametrize("module", ["purelight_export.graph", "purelight_train"])
def test_the_test_can_fail(module: str) -> None:
    assert module.split(".")[0] in loaded(module)
