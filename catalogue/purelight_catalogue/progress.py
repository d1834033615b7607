"""Progress over all jobs: one line, with the time left."""

from __future__ import annotations

import sys
import time
from collections import Counter, defaultdict
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
        self.left = Counter(job.stage for job in jobs)
        self.total, self.workers = len(jobs), max(workers, 1)
        self.done = Counter[str]()
        self.seconds = defaultdict[str, float](float)
        self.begun = time.monotonic()

    def ended(self, outcome: Outcome) -> None:
        """Count a job, and say so if it was done now."""
        self.left[outcome.job.stage] -= 1
        if not outcome.fault:
            self.done[outcome.job.stage] += 1
            self.seconds[outcome.job.stage] += outcome.seconds
        if not outcome.fresh:
            return
        said = f"FAILED: {outcome.fault}" if outcome.fault else duration(outcome.seconds)
        print(f"[{self.total - self.left.total()}/{self.total}] {outcome.job.title}: {said}"
              f"{self._remaining()}", file=sys.stderr, flush=True)  # fmt: skip

    def _remaining(self) -> str:
        if not self.left.total():
            return f"; all done in {duration(time.monotonic() - self.begun)}"
        seconds = sum(number * self._mean(stage) for stage, number in self.left.items())
        return f"; about {duration(seconds / self.workers)} left"

    def _mean(self, stage: str) -> float:
        """Seconds of a stage: its own so far, or what is expected, scaled as the others'."""
        if self.done[stage]:
            return self.seconds[stage] / self.done[stage]
        known = [s for s, number in self.done.items() if number]
        if not known:
            return EXPECTED[stage]
        scale = sum(map(self._mean, known)) / sum(EXPECTED[s] for s in known)
        return scale * EXPECTED[stage]
