"""Crash-safe files: a path holds its old bytes or its new bytes, never something between."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from stat import S_IMODE, S_ISREG
from typing import BinaryIO

from purelight_format.errors import PureLightError

REMEDIES = {
    errno.ENOSPC: "free some space or choose another folder",
    errno.EDQUOT: "free some space or choose another folder",
    errno.EACCES: "choose a folder that you may write to",
    errno.EPERM: "choose a folder that you may write to",
    errno.EROFS: "choose a folder that you may write to",
    errno.ENOENT: "create the folder first",
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
        path: a regular file, or a name not yet taken in an existing folder.

    Returns:
        The temporary file, open for writing and reading; its `name` is its path.

    Raises:
        PureLightError: If the file cannot be written.
    """
    path = Path(path)
    draft = path.with_name(f".{path.name[:64]}.{secrets.token_hex(8)}.tmp")
    try:
        mode = _mode(path)
        file = open(draft, "xb+")  # noqa: SIM115 - closed below, before it is renamed
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
        if error.filename not in (None, str(draft), str(path), str(path.parent)):
            raise  # The caller's own fault, about another file.
        remedy = REMEDIES.get(error.errno or 0, "nothing was changed")
        raise PureLightError(f"{path}: cannot write: {error.strerror}; {remedy}") from error
    _sync_folder(path.parent)


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
