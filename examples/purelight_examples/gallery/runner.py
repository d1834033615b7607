"""The gallery's lamps and rooms, one after the other, each in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from purelight_examples.gallery.settings import Settings
from purelight_train.runs.progress import duration

POLL = 0.5  # seconds
TITLE = re.compile(r"^\[\d+/\d+\] (.+?)(?: \.\.\. .*|: done before.*)$")
TAIL = 4096  # bytes of a log that are read


@dataclass(frozen=True)
class Outcome:
    """How a lamp or a room went.

    Arguments:
        fault: why it failed, in one line; empty if it did not.
    """

    kind: str
    name: str
    seconds: float
    fault: str = ""


@dataclass(frozen=True)
class Task:
    """A lamp or a room to make.

    Arguments:
        kind: `lamp` or `room`.
        folder: for its log.
    """

    kind: str
    name: str
    folder: Path
    gallery: Path
    settings: Settings

    @property
    def log(self) -> Path:
        return self.folder / "log.txt"

    def __call__(self, bar: tqdm) -> Outcome:
        """Run it to its end; the bar tells which stage it is at."""
        self.folder.mkdir(parents=True, exist_ok=True)
        start = time.monotonic()
        process = self._start()
        try:
            while process.poll() is None:
                bar.set_description_str(f"{self.name}: {stage(self.log)}")
                time.sleep(POLL)
        finally:
            if process.poll() is None:  # interrupted
                process.kill()
                process.wait()
        fault = "" if process.returncode == 0 else reason(self.log, process.returncode)
        return Outcome(self.kind, self.name, time.monotonic() - start, fault)

    def _start(self) -> subprocess.Popen[bytes]:
        words = [
            sys.executable, "-m", "purelight_examples.gallery.worker", self.kind, self.name,
            str(self.gallery), self.settings.to_json(),
        ]  # fmt: skip
        environment = os.environ | {"OMP_NUM_THREADS": str(self.settings.threads)}
        with open(self.log, "wb") as log:
            return subprocess.Popen(words, stdout=log, stderr=log, env=environment)


def stage(log: Path) -> str:
    """Title of the last stage that a log tells of."""
    titles = [m[1] for line in _lines(log) if (m := TITLE.match(line))]
    return titles[-1] if titles else "starting"


def reason(log: Path, code: int) -> str:
    """Why a process ended badly, from the last line of its log."""
    lines = _lines(log)
    last = lines[-1] if lines else ""
    why = last.partition("error: ")[2] or last or f"exit code {code}"
    return f"{why[:200]}; see {log}"


def line(outcome: Outcome, extra: str = "") -> str:
    """What is printed of a lamp or a room."""
    if outcome.fault:
        return f"{outcome.name}: failed: {outcome.fault}"
    words = [f"done in {duration(outcome.seconds)}", extra]
    return f"{outcome.name}: {', '.join(word for word in words if word)}"


def _lines(log: Path) -> list[str]:
    """The last lines of a log, those of its progress bars left out."""
    with open(log, "rb") as file:
        file.seek(max(0, log.stat().st_size - TAIL))
        text = file.read().decode(errors="replace")
    kept = [part.rpartition("\r")[2].strip() for part in text.split("\n")]
    return [one for one in kept if one and "%|" not in one]
