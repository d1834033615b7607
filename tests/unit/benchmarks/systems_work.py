"""Work for a process of its own that ends in all ways; it imports next to nothing."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

from purelight_format.errors import PureLightError


def other_process(first: int) -> Iterator[int]:
    yield first
    yield first + 1


def parent_of_it() -> Iterator[int]:
    yield os.getppid()


def refusing() -> Iterator[int]:
    yield 1
    raise PureLightError("as it should")


def dividing() -> Iterator[int]:
    yield 1 // 0


def aborting() -> Iterator[int]:
    yield 1
    os.abort()


def forever() -> Iterator[int]:
    yield 1
    time.sleep(600)
