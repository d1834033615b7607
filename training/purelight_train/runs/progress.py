"""A progress bar that also takes the time."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

from tqdm import tqdm

IN_LOG = 60.0  # seconds between two states where nobody watches


def duration(seconds: float) -> str:
    """Seconds as people say them."""
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.1f} min"
    return f"{seconds / 3600:.1f} h"


class Bar:
    """A bar on stderr with time left, called with the amount done so far.

    Arguments:
        title: what goes on.
        total: amount at the end, in `unit`s.
        finished: called with the seconds it took.
    """

    def __init__(self, title: str, total: int, unit: str, finished: Callable[[float], Any]) -> None:
        self.bar = tqdm(
            total=total,
            desc=f"{title:<22}",
            unit=unit,
            unit_scale=True,
            file=sys.stderr,
            mininterval=0.5 if sys.stderr.isatty() else IN_LOG,
            dynamic_ncols=True,
        )
        self.finished, self.start = finished, time.monotonic()

    def __enter__(self) -> Bar:
        return self

    def __call__(self, done: int, loss: float | None = None) -> None:
        if loss is not None:
            self.bar.set_postfix_str(f"loss {loss:.4g}", refresh=False)
        self.bar.update(min(done, self.bar.total) - self.bar.n)

    def part(self, done: float) -> None:
        """So much of the whole is done, 0 to 1."""
        self(round(done * self.bar.total))

    def __exit__(self, *_: object) -> None:
        self.bar.close()
        self.finished(time.monotonic() - self.start)
