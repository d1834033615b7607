"""What is no bundle at all: pipes, devices, strange names; and what reading may open."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from purelight_format import atomic, bundle, cli
from purelight_format.errors import PureLightError
from purelight_format.limits import LIMITS
from purelight_format.validation.validate import validate
from tests.assets import attacks_page, bad
from tests.support import lamp

POSIX = pytest.mark.skipif(os.name != "posix", reason="pipes, devices and links of POSIX")
ROOT = Path(__file__).parents[3]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    bundle.write(tmp_path / "lamp.plux", *lamp.parts())
    return tmp_path / "lamp.plux"


def refusal(path: Path | str) -> str:
    """The one line that says why a path is not read."""
    with pytest.raises(PureLightError) as caught:
        validate(path)
    assert cli.validate_main([str(path)]) == 2
    return str(caught.value)


@POSIX
def test_a_pipe_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert "not a regular file" in refusal(tmp_path / "pipe")


@POSIX
@pytest.mark.parametrize("device", ["/dev/zero", "/dev/null", "/dev/tty"])
def test_a_device_is_not_read(device: str) -> None:
    assert "cannot read" in refusal(device)


@POSIX
def test_links_that_lead_nowhere_are_one_line(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "lost").symlink_to(tmp_path / "nothing")
    for name in ("loop", "lost"):
        assert "cannot read" in refusal(tmp_path / name)


def test_folders_and_impossible_names_are_one_line(tmp_path: Path) -> None:
    assert "cannot read" in refusal(tmp_path)
    assert "null" in refusal("lamp\0.plux")
    assert "cannot read" in refusal("x" * 5000)


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    with open(tmp_path / "hole", "wb") as file:
        file.truncate(1 << 40)
    found = validate(tmp_path / "hole").issues
    assert [issue.code.name for issue in found] == ["PLX_FILE_TOO_LARGE"]
    assert f"{1 << 40} bytes, at most {LIMITS.file_bytes}" in found[0].message


@POSIX
@pytest.mark.parametrize("name", [b"a\x1b[2J.plux", b"\xff.plux", b"two\nlines.plux"])
def test_a_files_name_cannot_steer_the_terminal(
    path: Path, name: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    strange = path.with_name(os.fsdecode(name))
    path.rename(strange)
    for flags in ([], ["--json"]):
        assert cli.validate_main([str(strange), *flags]) == 0
    assert cli.inspect_main([str(strange), "--json"]) == 0
    strange.write_bytes(b"no bundle")
    assert cli.inspect_main([str(strange)]) == 2
    for text in capsys.readouterr():
        assert text.replace("\n", "").isprintable()


def test_a_networks_name_cannot_steer_the_terminal(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cost = {"macs_per_sample": 1, "floats_per_sample": 1, "bytes": 1}
    strange = {f"\x1b[2J{k}" + "x" * 500: {"member": "a", **cost} for k in range(100)}
    known = json.loads(lamp.good()["manifest.json"])["networks"]
    path.write_bytes(bad.edited("networks", {**known, **strange}))
    assert cli.inspect_main([str(path)]) == 0
    out = capsys.readouterr().out
    assert len(out.splitlines()) <= 40
    assert max(map(len, out.splitlines())) <= 140
    assert out.replace("\n", "").isprintable()


@POSIX
def test_a_pipe_beside_a_bundle_is_left_alone(path: Path) -> None:
    os.mkfifo(path.with_suffix(".usda"))
    assert validate(path).issues == ()


def test_a_layer_of_another_lamp_beside_a_bundle_is_left_alone(path: Path) -> None:
    other = bad.side_text().replace("./lamp.plux", "./other.plux")
    path.with_suffix(".usda").write_text(other)
    assert validate(path).issues == ()


@POSIX
def test_a_pipe_is_not_replaced(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    with pytest.raises(PureLightError, match="not a regular file"):
        atomic.write_bytes(path.with_name("pipe"), b"")


OPENED = """
import sys
from pathlib import Path
from tests.assets import golden_reports, hostile
folder, opened = Path(sys.argv[1]), set()
names = [n for n in golden_reports.NAMES if n.startswith(tuple(sys.argv[2:]))]
made = [golden_reports.MAKERS[name] for name in names]
golden_reports.report_of(None, None, folder)  # Every module is loaded now.
sys.addaudithook(lambda event, args: opened.add(f"{event} {args[0]}"))
for name in names:
    golden_reports.report(name, folder)
for event in sorted(opened):
    if event.startswith(("open", "os.system", "subprocess", "socket", "pickle", "exec ", "import")):
        print(event)
"""


def test_no_hostile_bundle_makes_the_validator_open_anything_else(tmp_path: Path) -> None:
    """Python's own audit of a process that validates them all."""
    stages = [
        "PLX_ONNX",
        "PLX_NPY",
        "PLX_USD",
        "PLX_SIDE",
        "PLX_JSON",
        "PLX_ZIP_NAME",
        "PLX_GOLDEN",
    ]
    command = [sys.executable, "-c", OPENED, str(tmp_path), *stages]
    done = subprocess.run(command, check=True, capture_output=True, text=True, cwd=ROOT)
    lines = {line for line in done.stdout.splitlines() if not line.startswith("open <")}
    allowed = {f"open {tmp_path / name}" for name in ("lamp.plux", "lamp.usda")}
    assert {line for line in lines if not line.split()[1].isdecimal()} <= allowed
    assert f"open {tmp_path / 'lamp.plux'}" in lines


def test_the_page_of_attacks_is_current() -> None:
    current = (ROOT / "spec/ATTACKS.md").read_text()
    assert current == attacks_page.document(), "run: python -m tests.assets.attacks_page"


@pytest.mark.parametrize("place", sorted({row.test for row in attacks_page.FILES}))
def test_the_page_names_tests_that_exist(place: str) -> None:
    file, name = place.split("::")
    assert f"def {name}(" in (ROOT / file).read_text()
