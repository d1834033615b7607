"""Jobs on Dask: workers of this machine, or those of a scheduler that runs elsewhere.

Dask places each job where there is memory for it, keeps the order of a lamp's jobs, and gives a
lost worker's jobs to another. What a job's result is, and whether it is there, is not Dask's:
`results` knows, so that a scheduler may be lost too.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from purelight_catalogue.jobs import Job
from purelight_catalogue.work import Outcome, perform
from purelight_format.errors import PureLightError

MEMORY, GPU = "GIB", "GPU"  # Names of resources; a worker elsewhere is started with them
LOST_TRIES = 10  # workers lost under one job, before it counts as the one that kills them
RESERVE = 1.0  # GiB for the system
PATIENCE = "20s"  # for a scheduler to answer
# Watching itself so often, Dask takes processor time that is the jobs'
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
    "distributed.admin.system-monitor.interval": "5s",
}


@contextmanager
def engine(workers: int, address: str | None) -> Iterator[Any]:
    """A client of Dask.

    Arguments:
        workers: on this machine, one core each, if there is no address.
        address: of a scheduler, as `tcp://10.0.0.1:8786`.

    Raises:
        PureLightError: Dask is not installed, or nobody answers at the address.
    """
    try:
        import dask
        from distributed import Client, LocalCluster
    except ImportError:
        raise PureLightError('Dask is missing; pip install "purelight[cluster]"') from None
    with dask.config.set({
        "distributed.scheduler.allowed-failures": LOST_TRIES,
        "distributed.scheduler.worker-saturation": 1.0,
        "distributed.worker.memory.terminate": False,  # The commands hold it, not the worker
        "distributed.comm.timeouts.connect": PATIENCE,
        **QUIET,
    }):  # fmt: skip
        if address:
            with _connect(Client, address) as client:
                yield client
            return
        resources = {MEMORY: memory_of_a_worker(workers)}
        with LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=True, resources=resources,
            dashboard_address=":0", silence_logs=50, memory_limit=None,
        ) as cluster, Client(cluster) as client:  # fmt: skip
            yield client


def memory_of_a_worker(workers: int) -> float:
    """GiB of memory for each of so many workers on this machine."""
    pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return max(pages * size / 2**30 - RESERVE, 0.5) / workers


def _connect(client: Any, address: str) -> Any:
    try:
        return client(address, timeout=PATIENCE)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:200]
        raise PureLightError(f"no scheduler at {address}: {reason}") from None


def run(client: Any, jobs: Sequence[Job], results: Path, logs: Path) -> Iterator[Outcome]:
    """Do jobs; gives how each ended, as they end.

    Arguments:
        jobs: each behind those that it needs; one that is left out has its result already.

    Raises:
        PureLightError: the scheduler is lost; or no worker has the memory that a job needs.
    """
    from distributed import as_completed

    _check_memory(client, jobs)
    left, ended = {job.key: job for job in jobs}, dict[str, Outcome]()
    for round_ in range(LOST_TRIES):
        futures = _submit(client, list(left.values()), ended, results, logs, round_)
        keys = {future.key: key for key, future in futures.items()}
        for future in as_completed(list(futures.values())):
            job = left[keys[future.key]]
            if outcome := _outcome(future, job):
                ended[job.key] = outcome
                yield outcome
        left = {key: job for key, job in left.items() if key not in ended}
        if not left:
            return
        if client.status != "running":
            break
    raise PureLightError(
        "the scheduler is lost; start it again and run the same command: what is finished is kept"
    )


def _submit(
    client: Any, jobs: Sequence[Job], ended: Mapping[str, Outcome], results: Path, logs: Path,
    round_: int,
) -> dict[str, Any]:  # fmt: skip
    """The futures of jobs, by their keys; in each round of other names, since Dask keeps those."""
    futures: dict[str, Any] = {}
    for job in jobs:
        known = (futures.get(key) or ended.get(key) for key in job.before.values())
        needs = {MEMORY: job.gibibytes} | ({GPU: 1.0} if job.gpu else {})
        futures[job.key] = client.submit(
            perform, job, results, logs, 1, [one for one in known if one is not None],
            key=f"{job.stage}-{job.key}-{round_}", resources=needs, pure=True,
        )  # fmt: skip
    return futures


def _outcome(future: Any, job: Job) -> Outcome | None:
    """How a job ended; None if Dask let go of it: the scheduler is lost, or a worker at a moment
    when its result was asked for.
    """
    try:
        if future.status == "finished":
            return Outcome(**vars(future.result()))
        if future.status == "error":
            error = future.exception()
            return Outcome(job, f"{type(error).__name__}: {' '.join(str(error).split())[:200]}")
    except (CancelledError, OSError):  # The second where the scheduler dies while it is asked
        pass
    return None


def _check_memory(client: Any, jobs: Sequence[Job]) -> None:
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    if not workers:
        return  # They may come yet
    most = max(worker["resources"].get(MEMORY, 0.0) for worker in workers)
    needed = max((job.gibibytes for job in jobs), default=0.0)
    if needed > most:
        raise PureLightError(
            f"a job needs {needed:g} GiB of memory and the largest worker has {most:.1f}; use "
            f"fewer --workers, or start workers with --resources {MEMORY}={needed:g}"
        )
    if any(job.gpu for job in jobs) and not any(w["resources"].get(GPU) for w in workers):
        raise PureLightError(f"no worker has a GPU; start workers with --resources {GPU}=1")
