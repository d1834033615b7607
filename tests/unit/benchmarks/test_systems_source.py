"""What is measured anew when a file of the bench changes."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.systems import source
from benchmarks.systems.own import OWN
from benchmarks.systems.source import source_digest
from benchmarks.systems.tasks.room import Room


def test_a_system_is_all_that_it_imports() -> None:
    reached = source._reached(inspect.getfile(type(OWN[0])))
    assert {"real.py", "in_mitsuba.py", "isolated.py"} <= {path.name for path in reached}
    assert source_digest(OWN[0]) != source_digest(Room(8))


@pytest.mark.parametrize("style", ["from {0} import inner", "from {0}.inner import name",
                                   "def late():\n    import {0}.inner"])  # fmt: skip
def test_the_digest_follows_imports(
    style: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "benchmarks" / "probe"
    package.mkdir(parents=True)
    outer, inner, other = (package / f"{name}.py" for name in ("outer", "inner", "other"))
    outer.write_text(style.format("benchmarks.probe") + "\n")
    inner.write_text("from benchmarks.probe import other, outer\nname = 1\n")  # A circle
    other.write_text("")
    monkeypatch.setattr(source, "ROOT", tmp_path)
    assert source._reached(str(outer)) == {outer, inner, other}


def test_what_renders_holds_nothing_of_training() -> None:
    """Peak memory is the system's: the process of a series imports what the command's does."""
    code = "import sys, benchmarks.systems.__main__; sys.exit('torch' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=source.ROOT)
