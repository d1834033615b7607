"""All files of an export: whatever fails and whenever, each is the old one or the new one."""

from __future__ import annotations

import builtins
import errno
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from purelight_export import export as module
from purelight_export.export import export
from purelight_format import bundle
from purelight_format.errors import PureLightError
from purelight_format.validation.validate import validate

NAMES = ("lamp.plux", "lamp.ies", "lamp.shape.ies", "lamp.usda")
Files = dict[str, bytes]


def files(folder: Path) -> Files:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def old(run_directory: Path, tmp_path_factory: pytest.TempPathFactory) -> Files:
    """An earlier export of the lamp under another name."""
    folder = tmp_path_factory.mktemp("old")
    export(run_directory, folder / "lamp.plux", name="Old Lamp", networks=[])
    return files(folder)


@pytest.fixture(scope="module")
def write(run_directory: Path) -> Callable[[Path], None]:
    """The last steps of an export, with the networks made once."""
    calls: list[tuple[Any, ...]] = []

    def remember(path: Path, manifest: Any, members: Any) -> bundle.Bundle:
        calls.append((manifest, members))
        return original(path, manifest, members)

    original = bundle.write
    lamp = module.Facts(module.RunDirectory.open(run_directory), "New Lamp")
    with pytest.MonkeyPatch.context() as patch, module.tempfile.TemporaryDirectory() as folder:
        patch.setattr(bundle, "write", remember)
        export(run_directory, Path(folder) / "lamp.plux", name="New Lamp", networks=[])
    manifest, members = calls[-1]

    def last_steps(output: Path) -> None:
        module._beside(lamp, original(output, manifest, members), ("ies",))

    return last_steps


def fail_from(patch: pytest.MonkeyPatch, step: int, fault: BaseException) -> list[int]:
    """Makes every operation on the disk from the step-th on fail."""
    left = [step]

    def failing(function: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **options: Any) -> Any:
            left[0] -= 1
            if left[0] < 0:
                raise fault
            return function(*arguments, **options)

        return call

    class Watched:
        def __init__(self, file: Any) -> None:
            self._file, self.write, self.flush = file, failing(file.write), failing(file.flush)

        def __enter__(self) -> Watched:
            return self

        def __exit__(self, *_: object) -> None:
            self._file.close()

        def __getattr__(self, name: str) -> Any:
            return getattr(self._file, name)

    real = builtins.open

    def watched(path: Any, mode: str = "r", *arguments: Any, **options: Any) -> Any:
        file = real(path, mode, *arguments, **options)
        return Watched(file) if "x" in mode else file

    patch.setattr(builtins, "open", watched)
    for name in ("fsync", "replace", "chmod"):
        patch.setattr(os, name, failing(getattr(os, name)))
    return left


@pytest.mark.parametrize(
    "fault",
    [OSError(errno.ENOSPC, "No space left"), OSError(errno.EIO, "I/O error"), KeyboardInterrupt()],
    ids=["full", "broken", "interrupted"],
)
@pytest.mark.parametrize("existing", [True, False])
def test_a_fault_at_any_step_leaves_old_or_new_files(
    old: Files, write: Callable[[Path], None], tmp_path: Path, existing: bool, fault: BaseException
) -> None:
    (tmp_path / "new").mkdir()
    write(tmp_path / "new/lamp.plux")
    new, before = files(tmp_path / "new"), old if existing else {}
    step, done, seen = 0, False, set()
    while not done:
        folder = tmp_path / str(step)
        folder.mkdir()
        for name, data in before.items():
            (folder / name).write_bytes(data)
        with pytest.MonkeyPatch.context() as patch:
            left = fail_from(patch, step, fault)
            with suppress(PureLightError, KeyboardInterrupt):
                write(folder / "lamp.plux")
            done = left[0] >= 0
        found = files(folder)
        assert set(found) <= set(NAMES)  # No draft is left.
        assert all(found.get(name) in (before.get(name), new[name]) for name in NAMES)
        require_sound(folder, found, new)
        seen.add(sum(found.get(name) == new[name] for name in NAMES))
        step += 1
    assert found == new
    assert {0, len(NAMES)} <= seen
    assert seen & {1, 2, 3}  # It was met between two files as well.


def require_sound(folder: Path, found: Files, new: Files) -> None:
    """The layer never names a bundle that is not there; one of another bundle is noticed."""
    if "lamp.usda" in found:
        codes = {issue.code.name for issue in validate(folder / "lamp.plux").issues}
        mixed = found["lamp.plux"] == new["lamp.plux"] and found["lamp.usda"] != new["lamp.usda"]
        assert codes == ({"PLX_SIDE_DIGEST_MISMATCH"} if mixed else set())


def test_two_exports_are_the_same_bytes_in_every_file(run_directory: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        export(run_directory, tmp_path / name / "lamp.plux", networks=[])
    assert files(tmp_path / "a") == files(tmp_path / "b")
    assert set(files(tmp_path / "a")) == set(NAMES)
