"""Lamps of the benchmark side by side: jobs of the engine that makes catalogues, a lamp each."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence

from purelight_catalogue.engine import MEMORY, engine
from purelight_format.issues import plain

GIBIBYTES = 4.0  # that a lamp's training, truths and pictures may take
MODULE = "benchmarks.systems.__main__:measure"
LINE = 400


def run(
    lamps: Sequence[str], words: Sequence[str], workers: int, address: str | None
) -> dict[str, str]:
    """Measure lamps; what was finished before is not done again, by whomever.

    Arguments:
        words: options of the measurement, the same for all.
        workers: on this machine, one core each, if there is no address of a scheduler.

    Returns:
        why a lamp was not measured to its end, by its name.

    Raises:
        PureLightError: Dask is not installed, or nobody answers at the address.
    """
    faults = {}
    with engine(max(workers, 1), address) as client:
        from distributed import as_completed

        jobs = {
            client.submit(measured, lamp, tuple(words), resources={MEMORY: GIBIBYTES}, pure=False):
            lamp for lamp in lamps
        }  # fmt: skip
        for job in as_completed(list(jobs)):
            reason = job.result() if job.status == "finished" else f"its job was {job.status}"
            print(f"{jobs[job]}: {reason or 'measured'}", file=sys.stderr, flush=True)
            if reason:
                faults[jobs[job]] = reason
    return faults


def measured(lamp: str, words: Sequence[str]) -> str:
    """Measure a lamp in a process that ends with this one; why that failed, empty if not."""
    here = [sys.executable, "-m", "purelight_catalogue.child", str(os.getpid()), MODULE]
    done = subprocess.run(
        [*here, *words, "--lamps", lamp], capture_output=True, text=True, check=False
    )
    if not done.returncode:
        return ""
    lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
    return plain(lines[-1], LINE)
