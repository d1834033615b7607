"""Many inputs over several processes, each input watched for time and each process for memory."""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import resource
import time
import traceback
import warnings
from dataclasses import dataclass, field
from multiprocessing.sharedctypes import Synchronized
from pathlib import Path
from random import Random
from typing import Any

from tests.fuzz.targets import TARGETS

SLOW = 2.0  # Processor seconds that no input may take, however busy the machine.
HANG = 20.0  # Processor seconds on one input after which a process is ended,
IDLE = 300.0  # and seconds, for one that waits; it may wait for a busy machine.
MEMORY = 4 << 30  # Address space of a process.
SEEDS = 1 << 32  # Inputs of one seed.
POLL = 0.25


@dataclass
class Tally:
    """What was found on one target.

    Arguments:
        inputs, accepted: how many there were.
        seconds: of all processes.
        slowest: seconds that one input took.
        megabytes: the largest memory of a process.
        findings: what went wrong, with the number of the input that repeats it.
    """

    inputs: int = 0
    accepted: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    megabytes: int = 0
    findings: list[dict[str, Any]] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        """Takes in the tally of another process or run."""
        self.inputs += other.inputs
        self.accepted += other.accepted
        self.seconds = round(self.seconds + other.seconds, 2)
        self.slowest = round(max(self.slowest, other.slowest), 4)
        self.megabytes = max(self.megabytes, other.megabytes)
        self.findings += other.findings


def data_of(target: str, number: int) -> bytes:
    """The input of a number: the same in every run."""
    return TARGETS[target].make(Random(number))


def try_inputs(target: str, first: int, count: int, until: float, at: Any = None) -> Tally:
    """Runs numbered inputs in this process, until a time."""
    warnings.simplefilter("error")  # A warning is a thing that was not thought of.
    tally, check, began = Tally(), TARGETS[target].check, time.monotonic()
    for number in range(first, first + count):
        if at is not None:
            at.value = number
        data, start = data_of(target, number), time.process_time()
        try:
            tally.accepted += check(data)
        except BaseException as error:
            tally.findings.append(_finding(target, number, error))
        took = time.process_time() - start
        tally.inputs, tally.slowest = tally.inputs + 1, max(tally.slowest, took)
        if took > SLOW:
            tally.findings.append(_finding(target, number, TimeoutError(f"{took:.1f} s")))
        if len(tally.findings) > 10 or time.monotonic() > until:
            break
    tally.seconds = time.monotonic() - began
    tally.megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    return tally


def _finding(target: str, number: int, error: BaseException | str) -> dict[str, Any]:
    lines = traceback.format_exception(error) if isinstance(error, BaseException) else [error]
    return {"target": target, "number": number, "what": "".join(lines)[-1500:]}


def run(
    target: str,
    count: int,
    seconds: float,
    *,
    processes: int = 2,
    seed: int = 0,
    method: str = "spawn",
) -> Tally:
    """Runs inputs of a target in processes of their own; a crash or a hang is a finding."""
    context: Any = multiprocessing.get_context(method)
    share, until = -(-count // processes), time.monotonic() + seconds
    total, workers = Tally(), []
    for k in range(processes):
        first = seed * SEEDS + k * share
        results, at = context.SimpleQueue(), context.Value("Q", first, lock=False)
        arguments = (target, first, min(share, count - k * share), seconds, results, at)
        worker = context.Process(target=_work, args=arguments, daemon=True)
        worker.start()
        workers.append((worker, results, at))
    for worker, results, at in workers:
        total.add(_collect(target, worker, results, at, until))
    return total


def _work(target: str, first: int, count: int, seconds: float, results: Any, at: Any) -> None:
    faulthandler.enable()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    results.put(try_inputs(target, first, count, time.monotonic() + seconds, at))


def _collect(target: str, worker: Any, results: Any, at: Synchronized[int], until: float) -> Tally:
    """Waits for a process; one that stands still for too long is ended."""
    seen, since, used = at.value, time.monotonic() + IDLE, HANG  # Starting up takes a while.
    while results.empty() and worker.is_alive():
        if at.value != seen:
            seen, since, used = at.value, time.monotonic(), _processor_seconds(worker.pid)
        worked = _processor_seconds(worker.pid) - used
        if worked > HANG or time.monotonic() - since > IDLE:
            worker.kill()
            what = f"no answer after {worked:.0f} processor seconds"
            return Tally(findings=[_finding(target, seen, what)])
        time.sleep(POLL)
    if results.empty():
        worker.join()
        what = f"the process ended with {worker.exitcode}"
        return Tally(findings=[_finding(target, at.value, what)])
    tally = results.get()
    worker.join()
    return tally


def _processor_seconds(pid: int) -> float:
    """What a process has used so far; 0 where the system does not tell."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def save(findings: list[dict[str, Any]], folder: Path) -> None:
    """Keeps the inputs that were found, one file each."""
    folder.mkdir(parents=True, exist_ok=True)
    for found in findings:
        path = folder / f"{found['target']}-{found['number']}"
        path.write_bytes(data_of(found["target"], found["number"]))
        path.with_suffix(".txt").write_text(found["what"])
