"""GLSL ES 3.00 and WGSL in a real browser, without a GPU: every golden vector."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from purelight_format.bundle import Bundle
from purelight_shader import write
from tests.support import browser
from tests.support.compiled import require_compilers


@pytest.mark.parametrize("language", ["webgl", "wgsl"])
def test_golden_vectors_are_met(language: str, octahedron: Bundle, tmp_path: Path) -> None:
    require_compilers()
    browser.program()
    write(octahedron, language, tmp_path)
    title, result = browser.visit(tmp_path, "selftest.html")
    if "no WebGPU" in result or "no GPU" in result:
        pytest.skip(result)
    assert title == "passed", result
    errors = json.loads(result)["errors"]
    assert list(errors) == list(octahedron.manifest.networks)
    assert max(errors.values()) <= 1


def test_a_wrong_weight_is_found(octahedron: Bundle, tmp_path: Path) -> None:
    require_compilers()
    browser.program()
    write(octahedron, "webgl", tmp_path)
    path = tmp_path / "floats.bin"
    path.write_bytes((np.fromfile(path, "<f4") * np.float32(1.01)).astype("<f4").tobytes())
    title, result = browser.visit(tmp_path, "selftest.html")
    assert title == "failed"
    assert json.loads(result)["errors"]["appearance"] > 1
