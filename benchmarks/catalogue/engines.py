"""Dask and Ray on the same faults, with jobs that only sleep: which one a catalogue runs on.

python -m benchmarks.catalogue.engines --output out/engines [--engines dask ray] [--jobs 24]

A scheduler and two workers in processes of their own on the loopback interface; a worker is killed
three times (with all its processes, as a machine is lost) and the scheduler once, and the command
begun again. Told are jobs begun and finished, finished ones that the engine asked for again (it
loses results with a worker; a job knows what is done) and that were done again, exit codes, seconds
until the first job begins, and the memory of the engine's processes at the first blow. Needs
`distributed`, and `ray` where it is asked for.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

from benchmarks.catalogue.faults import free_port
from purelight_format import atomic, command

COMMAND = "python -m benchmarks.catalogue.engines"
WORKERS, SECONDS, PATIENCE, POLL, TRIES = 2, 1.0, 300.0, 0.1, 4
LOST = 2  # the exit code of a client whose scheduler is gone
Words = tuple[str, ...]


@dataclass(frozen=True)
class Kind:
    """An engine's commands for the port of its scheduler."""

    scheduler: Callable[[int], Words]
    worker: Callable[[int], Words]
    client: Callable[[int, Path, Sequence[int]], bool]


def job(folder: Path, number: int) -> int:
    """Sleep, and leave a file that tells when it was finished; what is done is not done again."""
    if (folder / f"{number}.done").is_file():
        _note(folder / "again.txt", number)
        return number
    _note(folder / "begun.txt", number)
    time.sleep(SECONDS)
    _note(folder / "ended.txt", number)
    atomic.write_bytes(folder / f"{number}.done", str(time.time_ns()).encode())
    return number


def _note(path: Path, number: int) -> None:
    with open(path, "a") as file:
        file.write(f"{number} {time.time()}\n")


def _lines(path: Path) -> int:
    return len(path.read_text().splitlines()) if path.is_file() else 0


def on_dask(port: int, folder: Path, numbers: Sequence[int]) -> bool:
    """Do the jobs; whether all ended."""
    import dask
    from distributed import Client, as_completed

    dask.config.set({"distributed.scheduler.allowed-failures": 10,
                     "distributed.comm.timeouts.connect": "20s"})  # fmt: skip
    with Client(f"tcp://127.0.0.1:{port}", timeout="20s") as client:
        jobs = [client.submit(job, folder, n, pure=False) for n in numbers]
        return all(one.status == "finished" for one in as_completed(jobs))


def on_ray(port: int, folder: Path, numbers: Sequence[int]) -> bool:
    """Do the jobs; whether all ended."""
    import ray

    ray.init(address=f"127.0.0.1:{port}", log_to_driver=False, logging_level="ERROR")
    remote = ray.remote(num_cpus=1, max_retries=10)(job)
    return sorted(ray.get([remote.remote(folder, n) for n in numbers])) == list(numbers)


def _dask(*words: str) -> Words:
    return (sys.executable, "-m", "dask", *words, "--no-dashboard")


def _ray(*words: str) -> Words:
    ray = str(Path(sys.executable).with_name("ray"))
    return (ray, "start", *words, "--block", "--disable-usage-stats",
            "--object-store-memory=100000000")  # fmt: skip


KINDS = {
    "dask": Kind(
        lambda port: _dask("scheduler", "--host", "127.0.0.1", "--port", str(port)),
        lambda port: _dask("worker", f"tcp://127.0.0.1:{port}", "--nthreads", "1", "--no-nanny"),
        on_dask,
    ),
    "ray": Kind(
        lambda port: _ray("--head", f"--port={port}", "--num-cpus=0", "--include-dashboard=false"),
        lambda port: _ray(f"--address=127.0.0.1:{port}", "--num-cpus=1"),
        on_ray,
    ),
}


@dataclass
class Trial:
    """One engine under blows."""

    kind: Kind
    name: str
    folder: Path
    jobs: int
    port: int = field(default_factory=free_port)
    scheduler: subprocess.Popen[bytes] | None = None
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)
    finished_before: dict[str, str] = field(default_factory=dict)
    blows: list[str] = field(default_factory=lambda: ["worker", "worker", "scheduler", "worker"])
    most_memory: float = 0.0

    def __call__(self) -> dict[str, Any]:
        """Figures of the trial."""
        begun, codes = time.time(), list[int]()
        try:
            while (not codes or codes[-1]) and len(codes) < TRIES:
                self.start()
                codes.append(self._attempt())
        finally:
            self.stop()
        done = self.done()
        first = float((self.folder / "begun.txt").read_text().split()[1])
        return {
            "jobs": self.jobs, "finished": len(done), "blows left": len(self.blows),
            "exit codes": codes, "begun": _lines(self.folder / "begun.txt"),
            "finished ones asked for again": _lines(self.folder / "again.txt"),
            "done again": sum(done.get(n) != when for n, when in self.finished_before.items()),
            "seconds to the first job": round(first - begun, 1),
            "seconds": round(time.time() - begun, 1),
            "MiB of scheduler and workers": round(self.most_memory / 2**20),
        }  # fmt: skip

    def _attempt(self) -> int:
        """The command once, with the blows that are due; its exit code."""
        client = self._begin(
            sys.executable, "-m", "benchmarks.catalogue.engines", "--client", self.name,
            str(self.port), "--output", str(self.folder), "--jobs", str(self.jobs),
        )  # fmt: skip
        limit = time.monotonic() + PATIENCE
        while client.poll() is None and time.monotonic() < limit:
            if self.blows and len(self.done()) >= self.jobs * (5 - len(self.blows)) // 6:
                self.most_memory = max(self.most_memory, self.memory())
                self.finished_before |= self.done()
                {"worker": self.kill_worker, "scheduler": self.stop}[self.blows.pop(0)]()
            if self.scheduler:
                self.start()
            time.sleep(POLL)
        self._kill(client)
        return client.returncode

    def start(self) -> None:
        """Start what does not run, or has ended by itself."""
        self.workers = [worker for worker in self.workers if worker.poll() is None]
        if self.scheduler is None:
            self.scheduler = self._begin(*self.kind.scheduler(self.port))
            time.sleep(5)
        while len(self.workers) < WORKERS:
            self.workers.append(self._begin(*self.kind.worker(self.port)))

    def kill_worker(self) -> None:
        """A worker with all that it started, and another in its place."""
        self._kill(self.workers.pop(0))
        self.start()

    def stop(self) -> None:
        """End everything; workers are of no use without their scheduler."""
        for process in (self.scheduler, *self.workers):
            if process:
                self._kill(process)
        self.scheduler, self.workers = None, []

    def done(self) -> dict[str, str]:
        """When each finished job was."""
        return {p.name: p.read_text() for p in self.folder.glob("*.done")}

    def memory(self) -> float:
        """Bytes that scheduler and workers have, shared pages in parts."""
        total = 0.0
        for process in (self.scheduler, *self.workers):
            assert process is not None
            root = psutil.Process(process.pid)
            for one in (root, *root.children(recursive=True)):
                total += one.memory_full_info().pss
        return total

    def _begin(self, *words: str) -> subprocess.Popen[bytes]:
        with open(self.folder / "said.txt", "ab") as said:
            return subprocess.Popen(words, stdout=said, stderr=said, start_new_session=True)

    @staticmethod
    def _kill(process: subprocess.Popen[bytes]) -> None:
        """At once, and all that it started, in whatever sessions."""
        if process.poll() is None:
            for one in psutil.Process(process.pid).children(recursive=True):
                one.kill()
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def main() -> int:
    """Try the engines; 0, or 1 if one lost a job."""
    parser = command.Parser(prog=COMMAND, description=__doc__)
    add = parser.add_argument
    add("--output", type=Path, default=Path("out/engines"))
    add("--engines", nargs="+", choices=tuple(KINDS), default=list(KINDS))
    add("--jobs", type=command.whole(1), default=24)
    add("--client", nargs=2, metavar=("ENGINE", "PORT"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.client:
        return _client(options)
    found = {}
    for name in options.engines:
        folder = options.output.absolute() / name
        if folder.exists():
            command.warn(COMMAND, f"{folder}: is there already; choose another --output")
            return 2
        folder.mkdir(parents=True)
        found[name] = Trial(KINDS[name], name, folder, options.jobs)()
        print(f"{name}: {json.dumps(found[name], indent=1)}")
    return int(any(each["finished"] < each["jobs"] for each in found.values()))


def _client(options: argparse.Namespace) -> int:
    """Do what is not done yet, on an engine that runs."""
    name, port = options.client
    missing = [n for n in range(options.jobs) if not (options.output / f"{n}.done").is_file()]
    try:
        return 0 if KINDS[name].client(int(port), options.output, missing) else LOST
    except Exception as error:  # whatever an engine raises when its scheduler is gone
        print(f"{type(error).__name__}: {error}"[:400], file=sys.stderr)
        return LOST


if __name__ == "__main__":
    sys.exit(command.run(COMMAND, main))
