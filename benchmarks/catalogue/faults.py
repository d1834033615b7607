"""A scheduler and workers of Dask on this machine, which are killed while they work."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

MEMORY = 8  # GiB that a worker says it has


@dataclass
class Cluster:
    """Processes of their own, on the loopback interface."""

    log: Path
    workers: int
    port: int = 0
    scheduler: subprocess.Popen[bytes] | None = None
    running: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def address(self) -> str:
        return f"tcp://127.0.0.1:{self.port}"

    def start(self) -> None:
        """Start what does not run: the scheduler first, then the workers."""
        self.port = self.port or free_port()
        if self.scheduler is None:
            self.scheduler = self._begin(
                "scheduler", "--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard"
            )
        while len(self.running) < self.workers:
            self.running.append(self._begin(
                "worker", self.address, "--nworkers", "1", "--nthreads", "1", "--no-nanny",
                "--no-dashboard", "--memory-limit", "0", "--resources", f"GIB={MEMORY}",
            ))  # fmt: skip

    def kill_worker(self) -> None:
        """End one worker at once, and start another in its place."""
        self._kill(self.running.pop(0))
        self.start()

    def kill_scheduler(self) -> None:
        """End the scheduler at once; its workers end as well, since nobody asks them any more."""
        if self.scheduler:
            self._kill(self.scheduler)
        self.scheduler = None
        while self.running:
            self._kill(self.running.pop())

    def stop(self) -> None:
        """End everything."""
        self.kill_scheduler()

    def _begin(self, *words: str) -> subprocess.Popen[bytes]:
        with open(self.log, "ab") as said:
            return subprocess.Popen(
                [sys.executable, "-m", "dask", *words], stdout=said, stderr=said
            )

    @staticmethod
    def _kill(process: subprocess.Popen[bytes]) -> None:
        process.send_signal(signal.SIGKILL)
        process.wait()


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


@dataclass
class Blows:
    """What is killed when: a worker after each number of finished jobs, the scheduler after one."""

    cluster: Cluster
    results: Path
    workers_at: list[int]
    scheduler_at: int
    before: dict[str, int] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)

    def __call__(self) -> None:
        """Kill what is due."""
        done = finished(self.results)
        if self.workers_at and len(done) >= self.workers_at[0]:
            self.workers_at.pop(0)
            self._blow("a worker", done)
            self.cluster.kill_worker()
        elif self.scheduler_at and len(done) >= self.scheduler_at:
            self.scheduler_at = 0
            self._blow("the scheduler", done)
            self.cluster.kill_scheduler()

    def _blow(self, what: str, done: dict[str, int]) -> None:
        self.before |= done
        self.told.append(f"{what} killed after {len(done)} jobs, {time.strftime('%T')}")

    def done_twice(self) -> list[str]:
        """Jobs that had been finished before a blow and were made anew since."""
        now = finished(self.results)
        return sorted(name for name, when in self.before.items() if now.get(name) != when)


def finished(results: Path) -> dict[str, int]:
    """When each finished job was, by its folder's name, in nanoseconds."""
    found = {}
    for record in results.glob("[!.]*/job.json"):
        try:
            found[record.parent.name] = record.stat().st_mtime_ns
        except OSError:
            continue
    return found


def digests(output: Path) -> dict[str, str]:
    """The digest of each lamp of a catalogue."""
    data = json.loads((output / "catalogue.json").read_text())
    return {lamp["name"]: lamp["digest"] for lamp in data["lamps"]}
