"""What each package says is public can be imported from it, and says its types."""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGES = (
    "purelight_format", "purelight_conformance", "purelight_onnx", "purelight_mitsuba",
    "purelight_import", "purelight_train", "purelight_export", "purelight_shader",
)  # fmt: skip


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_there_and_documented(package: str) -> None:
    importlib.import_module("purelight_mitsuba").use()
    module = importlib.import_module(package)
    assert module.__doc__
    assert len(set(module.__all__)) == len(module.__all__) > 1
    for name in module.__all__:
        found = getattr(module, name)
        if inspect.isclass(found) or inspect.isfunction(found):
            assert inspect.getdoc(found), name
            assert found.__module__.startswith("purelight_"), name


@pytest.mark.parametrize("package", PACKAGES)
def test_packages_say_their_types(package: str) -> None:
    (place,) = importlib.import_module(package).__path__
    assert (Path(place) / "py.typed").is_file()


@pytest.mark.parametrize("package", ["purelight_mitsuba", "purelight_train", "purelight_import"])
def test_a_wrong_name_is_an_attribute_error(package: str) -> None:
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = importlib.import_module(package).nothing


@pytest.mark.parametrize(
    ("package", "heavy"),
    [
        ("purelight_train", "torch"),
        ("purelight_import", "mitsuba"),
        ("purelight_export", "torch"),
        ("purelight_conformance", "onnx"),
        ("purelight_shader", "onnx"),
    ],
)
def test_a_face_loads_nothing_heavy(package: str, heavy: str) -> None:
    script = f"import sys, {package}; sys.exit({heavy!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0
