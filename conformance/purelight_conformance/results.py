"""How a host did: by vector, by set, and in all."""

from __future__ import annotations

from dataclasses import dataclass, field

from purelight_conformance.client import Hello
from purelight_conformance.flags import FLAGS
from purelight_conformance.suite import VectorSet

PASSED, FAILED, REFUSED, SKIPPED = OUTCOMES = ("passed", "failed", "refused", "skipped")


@dataclass(frozen=True)
class Failure:
    """A vector that is not met.

    Arguments:
        vector: its id.
        what: what is wrong with the answer.
        hunts: the flags it carries.
    """

    vector: str
    what: str
    hunts: tuple[str, ...]


@dataclass(frozen=True)
class Result:
    """How a host did on one set.

    Arguments:
        vectors: the set.
        outcome: of each vector, one of OUTCOMES.
        failures: of the vectors that failed.
    """

    vectors: VectorSet
    outcome: tuple[str, ...]
    failures: tuple[Failure, ...] = ()


@dataclass
class Report:
    """How a host did.

    Arguments:
        host: what it says of itself.
        results: by set, in the order of the suite.
        fault: how it broke down, empty if it did not.
    """

    host: Hello
    results: list[Result] = field(default_factory=list)
    fault: str = ""

    @property
    def failures(self) -> list[Failure]:
        return [failure for result in self.results for failure in result.failures]

    @property
    def conforms(self) -> bool:
        """Whether something was checked and nothing was wrong."""
        checked = any(PASSED in result.outcome for result in self.results)
        return checked and not self.fault and not self.failures

    def groups(self) -> dict[str, dict[str, int]]:
        """Number of vectors by group and outcome."""
        table: dict[str, dict[str, int]] = {}
        for result in self.results:
            row = table.setdefault(result.vectors.group, dict.fromkeys(OUTCOMES, 0))
            for outcome in result.outcome:
                row[outcome] += 1
        return table

    def caught(self) -> dict[str, tuple[int, int]]:
        """Failed and checked vectors of the bugs that were found, most surely found first."""
        counts: dict[str, list[int]] = {flag: [0, 0] for flag in FLAGS}
        for result in self.results:
            for flag, rows in result.vectors.flags.items():
                outcomes = [result.outcome[row] for row in rows]
                count = counts.setdefault(flag, [0, 0])  # A newer suite may hunt more.
                count[0] += outcomes.count(FAILED)
                count[1] += outcomes.count(FAILED) + outcomes.count(PASSED)
        found = {flag: (bad, total) for flag, (bad, total) in counts.items() if bad}
        return dict(sorted(found.items(), key=lambda item: -item[1][0] / item[1][1]))
