"""Records as series of growing samples, and what tables and fronts read from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from benchmarks.systems.records import Record

KINDS = ("illumination", "appearance")
PREFIXES = {"illumination": ("room",), "appearance": ("view_",)}  # of tasks that errors are of
OURS = "purelight_accurate"  # whose time is the equal time
GLARE, FLOOR, STRIPS, HALL = "glare_", "floor", "roughness", "instances_"


@dataclass(frozen=True)
class Step:
    """A system at one number of samples: means over the tasks of a kind.

    Arguments:
        samples: their mean where a system does not draw just what it is asked for.
        figures: that all of them have.
        tasks: which they are, sorted.
    """

    samples: int
    seconds: float
    figures: dict[str, float]
    tasks: tuple[str, ...] = ()


Timed = TypeVar("Timed", Step, Record)


class Results:
    """The records that count, by lamp, system and task."""

    def __init__(self, records: Iterable[Record]) -> None:
        self.records = list(records)
        self.lamps = _unique(r.lamp for r in self.records if r.system)
        self.systems = _unique(r.system for r in self.records if r.system)

    def of(self, lamp: str, system: str, prefix: str) -> list[Record]:
        """Pictures of tasks whose names begin so, by growing samples."""
        found = [
            r
            for r in self.records
            if (r.lamp, r.system) == (lamp, system) and r.task.startswith(prefix) and r.samples
        ]
        return sorted(found, key=lambda r: r.samples)

    def last(self, lamp: str, system: str, prefix: str) -> list[Record]:
        """The last picture of each such task."""
        return list({r.task: r for r in self.of(lamp, system, prefix)}.values())

    def chosen(self, lamp: str, system: str, prefix: str, *, equal_time: bool) -> list[Record]:
        """The last picture of each such task, or what it comes to in the time of our last one."""
        if not equal_time:
            return self.last(lamp, system, prefix)
        ours = {r.task: r.seconds for r in self.last(lamp, OURS, prefix)}
        every = self.of(lamp, system, prefix)
        tasks = _unique(r.task for r in every)
        picks = (at([r for r in every if r.task == t], ours.get(t)) for t in tasks)
        return [r for r in picks if r is not None]

    def reason(self, lamp: str, system: str, prefixes: Sequence[str]) -> str:
        """Why a system has no picture of such tasks, if it failed."""
        found = (
            r.failed
            for r in self.records
            if (r.lamp, r.system) == (lamp, system) and r.task.startswith(tuple(prefixes))
        )
        return next((reason for reason in found if reason), "")

    def steps(self, lamp: str, system: str, kind: str) -> list[Step]:
        """Errors at each number of samples that all tasks of a kind have.

        Counts of one step may differ, but not by a factor of two: some systems stop a little late.
        """
        every = [r for p in PREFIXES[kind] for r in self.of(lamp, system, p)]
        records = [r for r in every if r.figure("relative_error") is not None]
        tasks = sorted({r.task for r in records})
        found: list[list[Record]] = []
        for count in sorted({r.samples for r in records}):
            able = [[r for r in records if r.task == t and r.samples <= count] for t in tasks]
            if not all(able):
                continue
            picks = [series[-1] for series in able]
            new = not found or all(a is not b for a, b in zip(picks, found[-1], strict=True))
            if new and count < 2 * min(r.samples for r in picks):
                found.append(picks)
        return [_mean(picks) for picks in found]

    def cost(self, lamp: str, system: str) -> tuple[float, float] | None:
        """Seconds of precomputation and stored megabytes."""
        for record in reversed(self.records):
            if (record.lamp, record.system) == (lamp, system) and record.samples:
                return float(record.cost["seconds"]), float(record.cost["megabytes"])
        return None


def within(series: Sequence[Timed], seconds: float | None) -> Timed | None:
    """The last of a series that takes no longer, a tenth aside; the first if none does.

    Arguments:
        seconds: None for any.
    """
    if not series:
        return None
    able = [s for s in series if seconds is None or s.seconds <= 1.1 * seconds]
    return able[-1] if able else series[0]


def at(series: Sequence[Timed], seconds: float | None) -> Timed | None:
    """What a series comes to in so many seconds: log-log between its steps, as in `reach`.

    The first step if that takes longer, the last if it ends before.

    Arguments:
        seconds: None for any.
    """
    if not series or seconds is None or seconds >= series[-1].seconds:
        return series[-1] if series else None
    later = next(n for n, step in enumerate(series) if step.seconds > seconds)
    if not later:
        return series[0]
    one, two = series[later - 1], series[later]
    t = math.log(seconds / one.seconds) / math.log(two.seconds / one.seconds)
    return replace(
        one, seconds=seconds, samples=round(_between(one.samples, two.samples, t)),
        figures={n: _between(value, two.figures.get(n), t) for n, value in one.figures.items()},
    )  # fmt: skip


def _between(one: Any, two: Any, t: float) -> Any:
    """A part t of the way from one number to another, by logarithms where both have one sign."""
    if not all(isinstance(value, int | float) for value in (one, two)):
        return one
    if one * two > 0:
        return one * (two / one) ** t
    return one + t * (two - one)


def _mean(records: list[Record]) -> Step:
    names = set.intersection(*({n for n in r.figures if r.figure(n) is not None} for r in records))
    count = len(records)
    figures = {n: sum(r.figure(n) or 0.0 for r in records) / count for n in names}
    samples = round(sum(r.samples for r in records) / count)
    seconds = sum(r.seconds for r in records) / count
    return Step(samples, seconds, figures, tuple(sorted(r.task for r in records)))


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))


@dataclass(frozen=True)
class Reached:
    """Samples and seconds at which an error is reached.

    Arguments:
        extrapolated: past the series' end, where the error is taken to fall as 1 / samples.
    """

    samples: float
    seconds: float
    extrapolated: bool


def reach(steps: Sequence[Step], error: float, name: str = "relative_error") -> Reached | None:
    """Where a series comes down to an error, log-log between its steps.

    Before the first step it is that step's samples: so many were enough. Past the end, a mean
    square error of pure noise falls as 1 / samples: where it has not fallen from the first step to
    the last (bias), or without steps, None.
    """
    known = [s for s in steps if s.figures.get(name, 0) > 0]
    if not known or error <= 0:
        return None
    for earlier, later in zip([None, *known[:-1]], known, strict=True):
        if later.figures[name] > error:
            continue
        if earlier is None:
            return Reached(later.samples, later.seconds, False)
        a, b = earlier.figures[name], later.figures[name]
        t = (math.log(a) - math.log(error)) / (math.log(a) - math.log(b))
        return Reached(
            earlier.samples * (later.samples / earlier.samples) ** t,
            earlier.seconds * (later.seconds / max(earlier.seconds, 1e-9)) ** t, False,
        )  # fmt: skip
    end = known[-1]
    if len(known) < 2 or end.figures[name] >= known[0].figures[name]:
        return None
    factor = end.figures[name] / error
    return Reached(end.samples * factor, end.seconds * factor, True)
