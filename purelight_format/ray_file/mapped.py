"""Files of numbers, mapped into memory: nothing is read before it is used."""

from __future__ import annotations

import mmap
import os
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG
from typing import Any

import numpy as np
from numpy.typing import NDArray

from purelight_format.errors import PureLightError
from purelight_format.files import FLAGS


@dataclass(frozen=True)
class Mapped:
    """A regular file's bytes.

    Arguments:
        name: what to call it in errors.
    """

    name: str
    data: mmap.mmap | bytes

    @staticmethod
    def open(path: Path) -> Mapped:
        """Maps a file.

        Raises:
            PureLightError: If it cannot be read or is not a regular file.
        """
        try:
            with open(os.open(path, FLAGS), "rb") as file:
                status = os.fstat(file.fileno())
                if not S_ISREG(status.st_mode):
                    raise PureLightError(f"{path}: cannot read: not a regular file")
                if not status.st_size:
                    return Mapped(str(path), b"")
                return Mapped(str(path), mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
        except (OSError, ValueError) as error:
            cause = error.strerror if isinstance(error, OSError) else error
            raise PureLightError(f"{path}: cannot read: {cause}") from error

    def __len__(self) -> int:
        return len(self.data)

    def numbers(self, kind: str, count: int, offset: int) -> NDArray[Any]:
        """`count` numbers from a place on, as an array that looks into the file.

        Raises:
            PureLightError: If there are not so many.
        """
        end = offset + count * np.dtype(kind).itemsize
        if count < 0 or offset < 0 or end > len(self):
            raise PureLightError(
                f"{self.name}: cut off or damaged: {end} bytes expected, {len(self)} there"
            )
        return np.frombuffer(self.data, kind, count, offset)
