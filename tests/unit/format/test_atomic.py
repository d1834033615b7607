"""Old bytes or new bytes, whatever fails and whenever."""

from __future__ import annotations

import builtins
import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from purelight_format import atomic, bundle
from purelight_format.errors import PureLightError
from tests.support import lamp

OLD, NEW = b"old bytes", b"new bytes" * 100
POSIX = pytest.mark.skipif(os.name != "posix", reason="permissions of POSIX files")


class FaultyFile:
    """A file whose k-th write, flush or close fails as on a full disk, after half the bytes."""

    def __init__(self, file: Any, budget: list[int], fault: int) -> None:
        self._file, self._budget, self._fault = file, budget, fault

    def _spend(self) -> bool:
        self._budget[0] -= 1
        return self._budget[0] < 0

    def write(self, data: bytes) -> int:
        if self._spend():
            self._file.write(data[: len(data) // 2])
            raise OSError(self._fault, os.strerror(self._fault))
        return int(self._file.write(data))

    def flush(self) -> None:
        if self._spend():
            raise OSError(self._fault, os.strerror(self._fault))
        self._file.flush()

    def __enter__(self) -> FaultyFile:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def inject(monkeypatch: pytest.MonkeyPatch, step: int, fault: int = errno.ENOSPC) -> list[int]:
    """Makes the step-th operation on the disk fail, and every one after it."""
    budget = [step]
    real_open = builtins.open

    def faulty_open(path: Any, mode: str = "r", *args: Any, **options: Any) -> Any:
        file = real_open(path, mode, *args, **options)
        return FaultyFile(file, budget, fault) if "x" in mode else file

    monkeypatch.setattr(builtins, "open", faulty_open)
    for name in ("fsync", "replace", "chmod"):
        monkeypatch.setattr(os, name, failing(getattr(os, name), budget, fault))
    return budget


def failing(function: Any, budget: list[int], fault: int) -> Any:
    def call(*args: Any, **options: Any) -> Any:
        budget[0] -= 1
        if budget[0] < 0:
            raise OSError(fault, os.strerror(fault))
        return function(*args, **options)

    return call


@pytest.mark.parametrize("fault", [errno.ENOSPC, errno.EIO, errno.EDQUOT])
@pytest.mark.parametrize("existing", [True, False])
def test_a_fault_at_any_step_leaves_old_or_new_bytes(
    tmp_path: Path, existing: bool, fault: int
) -> None:
    outcomes = set()
    for step in range(20):
        path = tmp_path / f"{step}" / "lamp.plux"
        path.parent.mkdir()
        if existing:
            path.write_bytes(OLD)
        with pytest.MonkeyPatch.context() as monkeypatch:
            budget = inject(monkeypatch, step, fault)
            try:
                with atomic.replace_file(path) as file:
                    file.write(NEW[:50])
                    file.write(NEW[50:])
            except PureLightError as error:
                outcomes.add("failed" if str(path) in str(error) else "unnamed")
            else:
                assert path.read_bytes() == NEW
        found = path.read_bytes() if path.exists() else None
        assert found in (NEW, OLD if existing else None)
        assert [p.name for p in path.parent.iterdir()] == (["lamp.plux"] if found else [])
        if budget[0] > 0:
            assert found == NEW
            outcomes.add("written")
    assert outcomes == {"failed", "written"}  # The faults were met, and at last there was none.


def test_a_fault_while_writing_a_bundle_leaves_the_old_one(tmp_path: Path) -> None:
    path = tmp_path / "lamp.plux"
    path.write_bytes(OLD)
    for step in range(0, 60, 7):
        with pytest.MonkeyPatch.context() as monkeypatch:
            inject(monkeypatch, step)
            with pytest.raises(PureLightError, match="free some space"):
                bundle.write(path, *lamp.parts())
        assert path.read_bytes() == OLD
        assert list(tmp_path.iterdir()) == [path]


def interrupted_write(path: Path, error: type[BaseException]) -> None:
    with atomic.replace_file(path) as file:
        file.write(NEW)
        raise error


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_exception_of_the_caller_passes_and_nothing_changes(
    tmp_path: Path, error: type[BaseException]
) -> None:
    path = tmp_path / "file"
    path.write_bytes(OLD)
    with pytest.raises(error):
        interrupted_write(path, error)
    assert path.read_bytes() == OLD
    assert list(tmp_path.iterdir()) == [path]


def test_the_callers_own_file_errors_are_not_taken_for_ours(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), atomic.replace_file(tmp_path / "file"):
        (tmp_path / "missing input").read_bytes()


def test_a_missing_folder_is_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "new folder" / "file"
    atomic.write_bytes(path, NEW)
    assert path.read_bytes() == NEW


@pytest.mark.parametrize("name", ["taken/lamp.plux", "taken/folder/lamp.plux"])
def test_a_folder_whose_name_is_taken_is_one_clear_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "taken").write_bytes(OLD)
    for refuse in (atomic.check_file, lambda path: atomic.write_bytes(path, NEW)):
        with pytest.raises(PureLightError, match="the folder's name is that of a file"):
            refuse(tmp_path / name)
    assert (tmp_path / "taken").read_bytes() == OLD


def test_checking_a_place_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "old").write_bytes(OLD)
    atomic.check_file(tmp_path / "old")
    atomic.check_file(tmp_path / "missing" / "new")
    atomic.check_folder(tmp_path / "missing" / "folder")
    assert [path.name for path in tmp_path.iterdir()] == ["old"]
    assert (tmp_path / "old").read_bytes() == OLD


@POSIX
def test_places_that_cannot_be_written_are_found_before(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "target")
    for path in (tmp_path, tmp_path / "link"):
        with pytest.raises(PureLightError, match="not a regular file"):
            atomic.check_file(path)
    with pytest.raises(PureLightError, match="choose a shorter name"):
        atomic.check_file(tmp_path / ("x" * 300))
    with pytest.raises(PureLightError, match="cannot write"):
        atomic.check_folder("/proc/self/nowhere")
    with pytest.raises(PureLightError, match="cannot write"):
        atomic.check_folder(tmp_path / "link")


@POSIX
def test_what_is_no_regular_file_is_not_replaced(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "target")
    for path in (tmp_path, tmp_path / "link"):
        with pytest.raises(PureLightError, match="not a regular file"):
            atomic.write_bytes(path, NEW)
    assert not (tmp_path / "target").exists()


@POSIX
def test_permissions_are_the_old_ones_or_those_of_any_new_file(tmp_path: Path) -> None:
    plain, ours, old = (tmp_path / name for name in ("plain", "ours", "old"))
    before = os.umask(0o027)
    try:
        plain.write_bytes(NEW)
        old.write_bytes(OLD)
        old.chmod(0o604)
        for path in (ours, old):
            atomic.write_bytes(path, NEW)
    finally:
        os.umask(before)
    assert ours.stat().st_mode == plain.stat().st_mode
    assert old.stat().st_mode & 0o777 == 0o604


@POSIX
def test_a_draft_of_a_private_file_is_private(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(OLD)
    path.chmod(0o600)
    with atomic.replace_file(path) as draft:
        assert os.stat(draft.name).st_mode & 0o777 == 0o600
        draft.write(NEW)
    assert path.stat().st_mode & 0o777 == 0o600


@POSIX
def test_a_file_that_is_still_mapped_keeps_its_bytes(tmp_path: Path) -> None:
    import mmap

    path = tmp_path / "file"
    path.write_bytes(OLD)
    with open(path, "rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        atomic.write_bytes(path, NEW)
        assert mapped[:] == OLD
    assert path.read_bytes() == NEW


KILLED = """
import os, sys
from purelight_format import atomic
with atomic.replace_file(sys.argv[1]) as file:
    file.write(b"half of it")
    file.flush()
    os._exit(9)
"""

KILLED_AT_ANY_STEP = """
import builtins, os, sys
from purelight_format import atomic

def dying(function, budget):
    def call(*args, **options):
        budget[0] -= 1
        if budget[0] < 0:
            os._exit(9)
        return function(*args, **options)
    return call

def write(path, step):
    budget, real = [step], builtins.open
    def watched(*args, **options):
        file = real(*args, **options)
        class Watched:
            name, fileno = file.name, file.fileno
            write, flush = (staticmethod(dying(f, budget)) for f in (file.write, file.flush))
            def __enter__(self): return self
            def __exit__(self, *_): file.close()
        return Watched()
    builtins.open = watched
    for name in ("fsync", "replace", "chmod"):
        setattr(os, name, dying(getattr(os, name), budget))
    with atomic.replace_file(path) as file:
        file.write(b"new bytes" * 50)
        file.flush()
        file.write(b"new bytes" * 50)

for step in range(12):
    path = f"{sys.argv[1]}/{step}"
    with open(path, "wb") as file:
        file.write(b"old bytes")
    if not (child := os.fork()):
        write(path, step)
        os._exit(0)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""

FULL = """
import resource, sys
from purelight_format import atomic, errors
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
try:
    atomic.write_bytes(sys.argv[1], bytes(5000))
except errors.PureLightError as error:
    sys.exit(f"error: {error}")
"""


@POSIX
def test_a_killed_process_leaves_the_old_bytes(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(OLD)
    done = subprocess.run([sys.executable, "-c", KILLED, path], check=False)
    assert done.returncode == 9
    assert path.read_bytes() == OLD


@POSIX
def test_a_process_killed_at_any_step_leaves_old_or_new_bytes(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED_AT_ANY_STEP, str(tmp_path)]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    codes = [int(code) for code in done.stdout.split()]
    found = [(tmp_path / str(step)).read_bytes() for step in range(len(codes))]
    assert set(codes) == {9, 0}  # Killed at each step, and at last not at all.
    assert codes == sorted(codes, reverse=True)
    assert set(found) == {OLD, NEW}
    assert found.count(NEW) >= codes.count(0)


@POSIX
def test_a_folder_that_cannot_be_synchronised_is_no_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "no")

    monkeypatch.setattr(os, "open", refuse)
    atomic.write_bytes(tmp_path / "file", NEW)
    assert (tmp_path / "file").read_bytes() == NEW


@POSIX
def test_the_real_limit_of_a_file_is_one_clear_line(tmp_path: Path) -> None:
    command = [sys.executable, "-c", FULL, str(tmp_path / "file")]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 1
    assert "cannot write: File too large" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert not list(tmp_path.iterdir())
