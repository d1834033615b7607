"""Crash-safe files: a path holds its old bytes or its new bytes, never something between."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_IMODE, S_ISREG
from tempfile import TemporaryFile
from typing import BinaryIO

from purelight_format.errors import PureLightError

REMEDIES = {
    errno.ENOSPC: "free some space or choose another folder",
    errno.EDQUOT: "free some space or choose another folder",
    errno.EACCES: "choose a folder that you may write to",
    errno.EPERM: "choose a folder that you may write to",
    errno.EROFS: "choose a folder that you may write to",
    errno.EEXIST: "the folder's name is that of a file",
    errno.ENOTDIR: "the folder's name is that of a file",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def write_bytes(path: str | Path, data: bytes) -> None:
    """Replaces a file's content, see `replace_file`."""
    with replace_file(path) as file:
        file.write(data)


@contextmanager
def replace_file(path: str | Path) -> Iterator[BinaryIO]:
    """Opens a temporary file beside `path` that takes its place when the block ends well.

    The bytes are on the disk before the name points to them, an existing file keeps its
    permissions, and after any exception the old file is untouched and the temporary one gone.

    Arguments:
        path: a regular file, or a name not yet taken; its folder is made if there is none.

    Returns:
        The temporary file, open for writing and reading; its `name` is its path.

    Raises:
        PureLightError: If the file cannot be written.
    """
    path = Path(path)
    draft = path.with_name(f".{path.name[:64]}.{secrets.token_hex(8)}.tmp")
    try:
        mode = _mode(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        file = open(draft, "xb+", opener=_private if mode is not None else None)  # noqa: SIM115
        try:
            with file:
                yield file
                if mode is not None:
                    os.chmod(draft, mode)
                file.flush()
                os.fsync(file.fileno())
            os.replace(draft, path)
        except BaseException:
            with suppress(OSError):
                draft.unlink()
            raise
    except OSError as error:
        if error.filename not in (None, str(draft), *map(str, (path, *path.parents))):
            raise  # The caller's own fault, about another file.
        raise _refusal(path, error) from error
    _sync_folder(path.parent)


def check_file(path: str | Path) -> None:
    """Makes sure that `replace_file` can write a file, before work is done for it.

    Nothing is left behind, not even a folder that is missing.

    Raises:
        PureLightError: If it cannot.
    """
    path = Path(path)
    try:
        _mode(path)
    except OSError as error:
        raise _refusal(path, error) from error
    check_folder(path.parent)


def check_folder(path: str | Path) -> None:
    """Makes sure that a folder can be written to, or made, before work is done for it.

    Raises:
        PureLightError: If it cannot.
    """
    path = Path(path).absolute()
    try:
        there = next(folder for folder in (path, *path.parents) if os.path.lexists(folder))
        with TemporaryFile(dir=there):
            pass
    except OSError as error:
        raise _refusal(path, error) from error


def _private(path: str, flags: int) -> int:
    """Opens a draft that nobody else may read, as it may replace a file that nobody else may."""
    return os.open(path, flags, 0o600)


def _refusal(path: Path, error: OSError) -> PureLightError:
    remedy = REMEDIES.get(error.errno or 0, "nothing was changed")
    return PureLightError(f"{path}: cannot write: {error.strerror}; {remedy}")


def _mode(path: Path) -> int | None:
    """Permissions of the file that stands there, None if there is none."""
    try:
        status = path.lstat()
    except FileNotFoundError:
        return None
    if not S_ISREG(status.st_mode):
        raise PureLightError(f"{path}: not a regular file; choose another name")
    return S_IMODE(status.st_mode)


def _sync_folder(folder: Path) -> None:
    """Makes the new name itself durable, where a folder can be opened and synchronised.

    A fault is no failure: the new bytes are whole and on the disk, and until the folder follows
    a power failure can at worst bring back the old ones.
    """
    if os.name != "posix":
        return
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
