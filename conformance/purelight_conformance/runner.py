"""Puts a suite to a host and compares; the host never judges itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from purelight_conformance import sampling
from purelight_conformance.client import Client, Hello, HostError, RefusalError
from purelight_conformance.protocol import READER
from purelight_conformance.results import (
    FAILED,
    PASSED,
    REFUSED,
    SKIPPED,
    Failure,
    Report,
    Result,
)
from purelight_conformance.suite import NEVER, REQUIRED, Suite, VectorSet
from purelight_format.bundle import Bundle
from purelight_format.measures import BoundingSphere


def run(
    suite: Suite,
    command: str | Sequence[str],
    *,
    timeout: float = 120.0,
    statistics: bool = True,
    progress: Callable[[int, int, str], object] = lambda done, total, name: None,
) -> Report:
    """Puts every set to a host whose operation it offers, then the statistical tests.

    Sets of one bundle are put together, so that each is opened once. The statistical tests need
    the suite's lamp of `sampling.LAMP`.

    Arguments:
        command: program and arguments of the host.
        timeout: seconds that one answer may take.
        statistics: whether to put the statistical tests.
        progress: called before each set.

    Raises:
        HostError: If the host does not start or does not say hello; what goes wrong later is the
            report's `fault`.
    """
    order = {name: k for k, name in enumerate(["", *suite.bundles])}
    arranged = sorted(enumerate(suite.sets), key=lambda item: order[item[1].bundle])
    with Client(command, timeout) as client:
        report = Report(client.hello())
        session, results = _Session(client, suite, report.host), {}
        try:
            for done, (place, vectors) in enumerate(arranged):
                progress(done, len(arranged), vectors.id)
                results[place] = session.put(vectors)
            if statistics:
                progress(len(arranged), len(arranged), "statistics")
                results |= enumerate(session.draw(), len(arranged))
            client.end()
        except HostError as error:
            report.fault = str(error)
    report.results = [results[place] for place in sorted(results)]
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

    def draw(self) -> Iterator[Result]:
        """Puts the statistical tests."""
        if sampling.LAMP not in self._suite.bundles:
            return
        sphere = Bundle.open(self._suite.bundles[sampling.LAMP]).manifest.bounding_sphere
        for name, (_, _, test) in sampling.TESTS.items():
            vectors = sampling.vectors(name, sphere)
            if self._host.operations >= {vectors.operation, "sampler_pdf"}:
                yield self._tested(vectors, test, sphere)
            else:
                yield Result(vectors, (SKIPPED,) * len(vectors))

    def _tested(self, vectors: VectorSet, test: sampling.Test, sphere: BoundingSphere) -> Result:
        def ask(operation: str, inputs: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
            return self._client.evaluate(vectors.id, operation, {}, inputs)

        try:
            self._require_open(vectors.bundle)
            wrong = dict(enumerate(test(ask, sphere)))
        except RefusalError as error:
            return _refused(vectors, str(error))
        except sampling.AnswerError as error:
            return _all_failed(vectors, str(error))
        return _judged(vectors, {row: what for row, what in wrong.items() if what})

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
    return _judged(vectors, wrong)


def _judged(vectors: VectorSet, wrong: dict[int, str]) -> Result:
    """The result of a set of which some rows are wrong."""
    outcome = tuple(FAILED if row in wrong else PASSED for row in range(len(vectors)))
    failures = tuple(_failure(vectors, row, wrong[row]) for row in sorted(wrong))
    return Result(vectors, outcome, failures)
