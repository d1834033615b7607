"""Puts a suite to a host and compares; the host never judges itself."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from purelight_format.conformance.client import Client, Hello, HostError, RefusalError
from purelight_format.conformance.flags import FLAGS
from purelight_format.conformance.protocol import READER
from purelight_format.conformance.suite import NEVER, REQUIRED, Suite, VectorSet

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
                counts[flag][0] += outcomes.count(FAILED)
                counts[flag][1] += outcomes.count(FAILED) + outcomes.count(PASSED)
        found = {flag: (bad, total) for flag, (bad, total) in counts.items() if bad}
        return dict(sorted(found.items(), key=lambda item: -item[1][0] / item[1][1]))


def run(
    suite: Suite,
    command: str | Sequence[str],
    *,
    timeout: float = 120.0,
    progress: Callable[[int, int, str], object] = lambda done, total, name: None,
) -> Report:
    """Puts every set to a host whose operation it offers.

    Sets of one bundle are put together, so that each is opened once.

    Arguments:
        command: program and arguments of the host.
        timeout: seconds that one answer may take.
        progress: called before each set.

    Raises:
        HostError: If the host does not start or does not say hello; what goes wrong later is the
            report's `fault`.
    """
    order = {name: k for k, name in enumerate(["", *suite.bundles])}
    arranged = sorted(suite.sets, key=lambda vectors: order[vectors.bundle])
    with Client(command, timeout) as client:
        report = Report(client.hello())
        session, results = _Session(client, suite, report.host), {}
        for done, vectors in enumerate(arranged):
            progress(done, len(arranged), vectors.id)
            try:
                results[vectors.id] = session.put(vectors)
            except HostError as error:
                report.fault = str(error)
                break
    report.results = [results[v.id] for v in suite.sets if v.id in results]
    return report


class _Session:
    """A host at work, and the bundle it has open."""

    def __init__(self, client: Client, suite: Suite, host: Hello) -> None:
        self._client, self._suite, self._host = client, suite, host
        self._open = ""

    def put(self, vectors: VectorSet) -> Result:
        if vectors.operation not in self._host.operations:
            return Result(vectors, (SKIPPED,) * len(vectors))
        try:
            self._require_open(vectors.bundle)
            outputs = self._outputs(vectors)
        except RefusalError as error:
            return _refused(vectors, str(error))
        if vectors.refusal == REQUIRED:
            broken = f": {vectors.parameters['issue']}" if vectors.operation == READER else ""
            return _all_failed(vectors, f"was answered, but must be refused{broken}")
        return compare(vectors, outputs)

    def _require_open(self, bundle: str) -> None:
        if bundle and bundle != self._open:
            self._open = ""
            self._client.open(str(self._suite.bundles[bundle].resolve()))
            self._open = bundle

    def _outputs(self, vectors: VectorSet) -> dict[str, np.ndarray]:
        if vectors.operation == READER:  # That the file was opened is all there is to see.
            return {}
        put = (vectors.operation, vectors.parameters, vectors.sent())
        return self._client.evaluate(vectors.id, *put)


def _refused(vectors: VectorSet, reason: str) -> Result:
    if vectors.refusal == NEVER:
        return _all_failed(vectors, f"was refused: {reason}")
    outcome = PASSED if vectors.refusal == REQUIRED else REFUSED
    return Result(vectors, (outcome,) * len(vectors))


def _all_failed(vectors: VectorSet, what: str) -> Result:
    rows = range(len(vectors))
    failures = tuple(_failure(vectors, row, what) for row in rows)
    return Result(vectors, (FAILED,) * len(rows), failures)


def _failure(vectors: VectorSet, row: int, what: str) -> Failure:
    return Failure(f"{vectors.id}/{row}", what, tuple(vectors.flags_of(row)))


def compare(vectors: VectorSet, outputs: dict[str, np.ndarray]) -> Result:
    """Compares answers with a set; every copy of a vector must meet it, and means where wanted.

    |result - output| <= tolerance in every element; what is not finite is not met.
    """
    count = len(vectors) if vectors.rows is None else vectors.rows
    order = np.arange(count) % len(vectors)
    wrong: dict[int, str] = {}
    for name, expected in vectors.outputs.items():
        shape = (count * vectors.average, *expected.shape[1:])
        if name not in outputs:
            return _all_failed(vectors, f"{name} is missing")
        if outputs[name].shape != shape:
            return _all_failed(vectors, f"{name} has shape {outputs[name].shape}, not {shape}")
        with np.errstate(invalid="ignore", over="ignore"):
            answer = outputs[name].astype(np.float64)
            answer = answer.reshape(count, vectors.average, *expected.shape[1:]).mean(1)
            error = np.abs(answer - expected[order])
            met = np.isfinite(error) & (error <= vectors.tolerances[name][order])
            excess = np.where(met, 0, error)
        for row in np.flatnonzero((excess != 0).reshape(count, -1).any(1)) if count else ():
            allowed = vectors.tolerances[name][order[row]].max()
            text = f"{name} is off by {excess[row].max():.3g}, at most {allowed:.3g}"
            wrong.setdefault(int(order[row]), text)
    outcome = tuple(FAILED if row in wrong else PASSED for row in range(len(vectors)))
    failures = tuple(_failure(vectors, row, wrong[row]) for row in sorted(wrong))
    return Result(vectors, outcome, failures)
