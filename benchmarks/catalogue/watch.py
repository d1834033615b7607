"""A command under watch: its seconds, and the memory of it and of all that it starts."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import psutil

from benchmarks.zoo.runner import resident

POLL = 0.5  # seconds
ISSUED = "2000-01-01"  # the date in photometric files, so that digests of any day can be compared


@dataclass(frozen=True)
class Watched:
    """Arguments:
    code: its exit code.
    seconds: from its start to its end.
    gibibytes: the most that it and its descendants had resident at once.
    """

    code: int
    seconds: float
    gibibytes: float


def catalogue(words: Sequence[str], log: Path) -> subprocess.Popen[bytes]:
    """Begin `purelight-catalogue`; what it says is added to a log."""
    with open(log, "ab") as said:
        return subprocess.Popen(
            [sys.executable, "-m", "purelight_catalogue.cli", *words, "--issued", ISSUED],
            stdout=said, stderr=said,
        )  # fmt: skip


def watch(process: subprocess.Popen[bytes], each: Callable[[], None] = lambda: None) -> Watched:
    """Wait for a process, and call `each` every half second."""
    begun, most = time.monotonic(), 0.0
    while process.poll() is None:
        most = max(most, _together(process.pid))
        each()
        time.sleep(POLL)
    return Watched(process.returncode, time.monotonic() - begun, most / 2**30)


def _together(pid: int) -> float:
    """Bytes that a process and its descendants have in memory; pages shared count for each."""
    try:
        root = psutil.Process(pid)
        return sum(resident(one.pid) for one in (root, *root.children(recursive=True)))
    except psutil.Error:
        return 0.0
