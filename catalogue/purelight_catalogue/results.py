"""Results by the digest of what they are made from, in a folder that many workers share.

    RESULTS/train-0123456789abcdef/         a finished job's files; `job.json` is written last
    RESULTS/.train-0123….HOST.PID.RANDOM/   one that is being done
    RESULTS/begun-2026-01-31                the day of the first command

A job is done in a folder of its own, which gets its name once it is whole: a worker that is killed,
a full disk or a power failure leaves either nothing or everything. Two workers that do the same job
do not meet; the first to end gives the result.
"""

from __future__ import annotations

import json
import os
import secrets
import shutil
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from purelight_catalogue.jobs import Job
from purelight_format import atomic

NAME = 16  # digits of a key in a folder's name
RECORD = "job.json"
BEGUN = "begun-"


@dataclass(frozen=True)
class Done:
    """What is known of a finished job.

    Arguments:
        seconds: it took; gibibytes: the most memory it had; host: the machine's name.
    """

    key: str
    stage: str
    seconds: float
    gibibytes: float
    host: str


@dataclass(frozen=True)
class Results:
    """The folder of results."""

    folder: Path

    def path(self, stage: str, key: str) -> Path:
        """Where a job's result is, or will be."""
        return self.folder / f"{stage}-{key[:NAME]}"

    def done(self, job: Job) -> Done | None:
        """What is known of a job if it is finished."""
        return self.record(job.stage, job.key)

    def record(self, stage: str, key: str) -> Done | None:
        """The same by stage and key."""
        try:
            record = Done(**json.loads((self.path(stage, key) / RECORD).read_bytes()))
        except (OSError, ValueError, TypeError):
            return None
        return record if record.key == key else None

    @contextmanager
    def attempt(self, job: Job) -> Iterator[Path]:
        """A new folder to do a job in; it is gone afterwards, unless `keep` was called."""
        self.folder.mkdir(parents=True, exist_ok=True)
        mark = f"{socket.gethostname()}.{os.getpid()}.{secrets.token_hex(4)}"
        draft = self.folder / f".{job.stage}-{job.key[:NAME]}.{mark}"
        draft.mkdir()
        try:
            yield draft
        finally:
            shutil.rmtree(draft, ignore_errors=True)

    def keep(self, draft: Path, job: Job, seconds: float, gibibytes: float) -> Done:
        """Give a finished job's folder its name, unless another worker was faster."""
        done = Done(job.key, job.stage, round(seconds, 2), gibibytes, socket.gethostname())
        atomic.write_bytes(draft / RECORD, json.dumps(asdict(done), indent=1).encode())
        home = self.path(job.stage, job.key)
        if self.done(job) is None and home.exists():
            shutil.rmtree(home)  # begun by hand or by an older version
        with suppress(FileExistsError, OSError):
            os.rename(draft, home)
        return self.record(job.stage, job.key) or _not_kept(home)

    def begun(self) -> str:
        """The day on which the first command came to this folder, YYYY-MM-DD, by UTC.

        A file's name tells it: where commands begin side by side at midnight, the earliest counts
        for all of them.
        """
        if not any(self.folder.glob(f"{BEGUN}*")):
            self.folder.mkdir(parents=True, exist_ok=True)
            (self.folder / f"{BEGUN}{datetime.now(timezone.utc):%Y-%m-%d}").touch()
        return min(file.name for file in self.folder.glob(f"{BEGUN}*")).removeprefix(BEGUN)

    def sweep(self) -> int:
        """Remove the drafts of processes of this machine that are gone; how many there were."""
        gone = [draft for draft in self.folder.glob(".*.*.*.*") if _abandoned(draft)]
        for draft in gone:
            shutil.rmtree(draft, ignore_errors=True)
        return len(gone)


def _not_kept(home: Path) -> Any:
    raise OSError(None, "cannot keep a finished job's folder", str(home))


def _abandoned(draft: Path) -> bool:
    *host, pid, _ = draft.name[1:].split(".")[1:]
    if ".".join(host) != socket.gethostname() or not pid.isdigit():
        return False
    return not Path(f"/proc/{pid}").exists() if Path("/proc/self").exists() else False
