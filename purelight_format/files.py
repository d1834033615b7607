"""Files from anywhere, read whole: regular ones, and none above its limit."""

from __future__ import annotations

import os
from pathlib import Path
from stat import S_ISREG

from purelight_format.errors import PureLightError
from purelight_format.issues import fail

FLAGS = os.O_RDONLY | getattr(os, "O_BINARY", 0) | getattr(os, "O_NONBLOCK", 0)


def is_file(path: Path) -> bool:
    """Whether a regular file is there; not where the name is none that a file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_file(path: Path, limit: int) -> bytes:
    """Reads a file, which is opened without waiting: a pipe or a device is never read.

    Raises:
        PureLightError: If it cannot be read or is not a regular file.
        FormatError: PLX_FILE_TOO_LARGE.
    """
    try:
        with open(os.open(path, FLAGS), "rb") as file:
            status = os.fstat(file.fileno())
            if not S_ISREG(status.st_mode):
                raise PureLightError(f"{path}: cannot read: not a regular file")
            data = file.read(limit + 1) if status.st_size <= limit else b""
            size = max(status.st_size, len(data))  # It may have grown.
    except (OSError, ValueError) as error:  # The latter for names that no file can have.
        cause = error.strerror if isinstance(error, OSError) else error
        raise PureLightError(f"{path}: cannot read: {cause}") from error
    if size > limit:
        fail("PLX_FILE_TOO_LARGE", "file", size=size, limit=limit)
    return data
