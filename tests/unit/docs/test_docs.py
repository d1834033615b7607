"""The documentation: it builds, its examples run, and what it names is there."""

from __future__ import annotations

import doctest
import importlib
import os
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

from tests.support import lamp

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
PAGES = sorted(page for page in DOCS.rglob("*.md") if page.parent.name != "spec")
PACKAGES = {
    "purelight_format": ROOT, "purelight_conformance": ROOT / "conformance",
    "purelight_onnx": ROOT / "runtimes/onnx", "purelight_mitsuba": ROOT / "runtimes/mitsuba",
    "purelight_train": ROOT / "training", "purelight_export": ROOT / "exporters",
    "purelight_cpp": ROOT / "runtimes/cpp",
}  # fmt: skip
DOCTESTS = (
    "purelight_format.color", "purelight_format.measures", "purelight_format.validation.validate",
)  # fmt: skip


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    words = ["--fail-on-warning", "--keep-going", "-q", "-D", "nb_execution_mode=off"]
    command = [sys.executable, "-m", "sphinx", *words, str(DOCS), str(tmp_path / "site")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "mfrac" in (tmp_path / "site/concepts.html").read_text()
    pages = [page.read_text() for page in (tmp_path / "site").rglob("*.html")]
    assert not [
        page for page in pages if re.search(r"(src|href)=\"https?://[^\"]+\.(js|css)", page)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_files_that_are_named_are_there(page: Path) -> None:
    files = [path for path in ROOT.rglob("*.py") if ".venv" not in path.parts]
    known = [str(path.relative_to(ROOT)) for path in files]
    for name in re.findall(r"`([\w/]+\.py)`", page.read_text()):
        assert any(path == name or path.endswith(f"/{name}") for path in known), name


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS)))
def test_no_page_waits_for_its_end(page: Path) -> None:
    assert not re.findall(r"\b(?:FIGURES?|TODO|TBD|FIXME)\b", page.read_text())


@pytest.mark.parametrize("name", ["look_and_measure", "train_and_err"])
def test_notebooks_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bundle = tmp_path / "lamp.plux"
    bundle.write_bytes(lamp.seal(lamp.good()))
    monkeypatch.setenv("PURELIGHT_LAMP", str(bundle))
    paths = os.pathsep.join(map(str, PACKAGES.values())) + os.pathsep + str(ROOT / "examples")
    monkeypatch.setenv("PYTHONPATH", paths)
    book = nbformat.read(DOCS / "notebooks" / f"{name}.ipynb", 4)
    NotebookClient(book, timeout=900, kernel_name="python3").execute(cwd=str(tmp_path))
    pictures = [
        output
        for cell in book.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]
    assert len(pictures) >= 2


@pytest.mark.parametrize("name", DOCTESTS)
def test_examples_in_docstrings(name: str) -> None:
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried > 0
    assert failed == 0
