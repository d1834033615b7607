"""The zip: the same bytes each time, whole, and what Blender's own checker asks for."""

from __future__ import annotations

import base64
import hashlib
import io
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from purelight_blender import packing
from tests.support import osl_picture

ROOT = Path(__file__).parents[3]


def test_the_same_code_gives_the_same_bytes(archive: Path) -> None:
    code = "from purelight_blender import packing; import hashlib; " \
        "print(hashlib.sha256(packing.extension()).hexdigest())"  # fmt: skip
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == hashlib.sha256(archive.read_bytes()).hexdigest()


def test_it_holds_what_it_needs_and_no_more(archive: Path) -> None:
    with zipfile.ZipFile(archive) as file:
        names = file.namelist()
        (wheel,) = (name for name in names if name.endswith(".whl"))
        inner = zipfile.ZipFile(io.BytesIO(file.read(wheel)))
        manifest = file.read("blender_manifest.toml").decode()
    assert "__init__.py" in names
    assert "packing.py" not in names
    assert f'wheels = ["./{wheel}"]' in manifest
    assert not any("__pycache__" in name for name in (*names, *inner.namelist()))
    about = wheel.split("/")[1].rsplit("-", 3)[0] + ".dist-info"
    lines = inner.read(f"{about}/RECORD").decode().splitlines()
    assert len(lines) == len(inner.namelist())
    for line in lines[:-1]:
        name, digest, size = line.rsplit(",", 2)
        data = inner.read(name)
        text = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).decode().rstrip("=")
        assert (digest, size) == (f"sha256={text}", str(len(data)))


def test_versions_agree() -> None:
    project = (ROOT / "pyproject.toml").read_text()
    (version,) = re.findall(r'^version = "(.*)"', project, re.MULTILINE)
    manifest = (packing.HERE / "blender_manifest.toml").read_text()
    assert f'\nversion = "{version}"' in manifest
    assert packing.named_wheel(manifest) == f"wheels/purelight-{version}-py3-none-any.whl"


def test_a_file_that_cannot_be_written_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "folder").mkdir()
    assert packing.main(["--output", str(tmp_path / "folder")]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_blender_finds_no_fault_in_it(archive: Path) -> None:
    program = osl_picture.python()
    if program is None:
        pytest.skip(f"no Python with bpy: name one in {osl_picture.VARIABLE}, or make test-blender")
    find = "from importlib.util import find_spec; print(find_spec('bpy').origin)"
    origin = subprocess.run([program, "-c", find], capture_output=True, text=True, check=True)
    (checker,) = Path(origin.stdout.strip()).parent.glob(
        "*/scripts/addons_core/bl_pkg/cli/blender_ext.py"
    )
    done = subprocess.run([program, str(checker), "validate", str(archive)], check=False,
                          capture_output=True, text=True)  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
