"""What every command prints: plain text in any encoding."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.assets import bad
from tests.support import lamp

ODD = "Lämpchen \u202eevil\x9b2J 灯"  # A bidi mark and a C1 control among letters.


def manifest_with(text: str) -> bytes:
    """The good lamp with a text in its provenance, which is kept as it is."""
    value = json.loads(lamp.good()["manifest.json"])
    value["provenance"] = {"scene": text, text: 1}
    return bad.manifest(json.dumps(value).encode())


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8", "utf-16"])
@pytest.mark.parametrize(
    "words",
    [("validate",), ("validate", "--json"), ("inspect",), ("inspect", "--json")],
)
def test_nothing_of_a_file_steers_a_terminal(
    words: tuple[str, ...], encoding: str, tmp_path: Path
) -> None:
    path = tmp_path / "lämp\u202e.plux"
    path.write_bytes(manifest_with(ODD))
    call = f"from purelight_format import cli; raise SystemExit(cli.{words[0]}_main())"
    done = subprocess.run(
        [sys.executable, "-c", call, str(path), *words[1:]],
        env=os.environ | {"PYTHONIOENCODING": encoding}, capture_output=True,
        check=False, timeout=120,
    )  # fmt: skip
    out = done.stdout.decode(encoding)
    assert (done.returncode, done.stderr) == (0, b"")
    assert all(c.isprintable() for line in out.split("\n") for c in line.rstrip("\r"))
    if "--json" in words:
        assert json.loads(out)


def test_an_error_in_a_narrow_encoding_is_still_a_line(tmp_path: Path) -> None:
    path = tmp_path / "灯\n.plux"
    call = "from purelight_format import cli; raise SystemExit(cli.validate_main())"
    done = subprocess.run(
        [sys.executable, "-c", call, str(path)],
        env=os.environ | {"PYTHONIOENCODING": "ascii"}, capture_output=True,
        check=False, timeout=120,
    )  # fmt: skip
    assert done.returncode == 2
    assert done.stderr.decode("ascii").count("\n") == 1
