"""Progress over all jobs: one line, with the time left."""

from __future__ import annotations

import sys
import time
from collections import defaultdict
from collections.abc import Sequence

from purelight_catalogue.jobs import Job
from purelight_catalogue.work import Outcome
from purelight_train.runs.progress import duration

# Shares of a lamp's work, until this run has shown its own
EXPECTED = {
    "train": 300.0, "size": 300.0, "export": 15.0, "check": 3.0, "picture": 5.0, "photons": 240.0,
    "photometry": 3.0,
}  # fmt: skip


class Progress:
    """Tells of jobs as they end; how long the others will take, by those of their stage.

    Arguments:
        jobs: all of them.
        workers: that work side by side.
    """

    def __init__(self, jobs: Sequence[Job], workers: int) -> None:
        self.left = {job.key: job for job in jobs}
        self.total, self.workers = len(self.left), max(workers, 1)
        self.taken: dict[str, list[float]] = defaultdict(list)
        self.begun = time.monotonic()
        self.found = self.failed = 0

    def ended(self, outcome: Outcome) -> None:
        """Count a job, and say so if it was done now."""
        self.left.pop(outcome.job.key, None)
        self.failed += bool(outcome.fault)
        if not outcome.fault:
            self.taken[outcome.job.stage].append(outcome.seconds)
        if not outcome.fresh:
            self.found += 1
            return
        said = f"FAILED: {outcome.fault}" if outcome.fault else duration(outcome.seconds)
        print(f"[{self.total - len(self.left)}/{self.total}] {outcome.job.title}: {said}"
              f"{self._remaining()}", file=sys.stderr, flush=True)  # fmt: skip

    def _remaining(self) -> str:
        if not self.left:
            return f"; all done in {duration(time.monotonic() - self.begun)}"
        seconds = sum(self._mean(job.stage) for job in self.left.values()) / self.workers
        return f"; about {duration(seconds)} left"

    def _mean(self, stage: str) -> float:
        """Seconds of a stage: what is expected counts as one job seen, scaled by the others."""
        if self.taken[stage]:
            return sum(self.taken[stage]) / len(self.taken[stage])
        known = [s for s, times in self.taken.items() if times]
        if not known:
            return EXPECTED[stage]
        scale = sum(self._mean(s) for s in known) / sum(EXPECTED[s] for s in known)
        return scale * EXPECTED[stage]
