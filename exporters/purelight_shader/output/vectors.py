"""The golden vectors of a lamp as three tables, for kernels that read plain buffers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from purelight_shader.targets.slang_module import inputs, outputs
from purelight_shader.translation import Translation

LOOSE = 3e38  # Tolerance of numbers that a network does not answer.


@dataclass(frozen=True)
class SelfTest:
    """Rows of all networks, one network after the other.

    Arguments:
        inputs: [N, I] the number of the network, and what it is asked.
        expected: [N, O] what it answers, followed by zeros.
        tolerances: [N, O] how far an answer may be off, `LOOSE` where there is none.
        networks: by their numbers.
    """

    inputs: np.ndarray
    expected: np.ndarray
    tolerances: np.ndarray
    networks: tuple[str, ...]

    def files(self) -> Iterator[tuple[str, bytes]]:
        """The tables as files."""
        for name in ("inputs", "expected", "tolerances"):
            table: np.ndarray = getattr(self, name)
            yield f"selftest_{name}.bin", table.astype("<f4").tobytes()

    def errors(self, answers: np.ndarray) -> dict[str, float]:
        """The largest error of each network in units of its tolerance: what is above one fails."""
        off = np.abs(answers.astype(np.float64) - self.expected)
        with np.errstate(all="ignore"):
            share = np.where(off == 0, 0, off / self.tolerances)
        worst = np.where(np.isfinite(answers), share, np.inf).max(1)
        return {
            network: float(worst[self.inputs[:, 0] == k].max())
            for k, network in enumerate(self.networks)
        }


def selftest(translation: Translation) -> SelfTest:
    """The rows of a lamp."""
    programs, tables = translation.programs, []
    width, room = inputs(programs), outputs(programs)
    for index, network in enumerate(programs):
        vectors = translation.bundle.vectors(network)
        given = _rows(vectors.inputs.values(), width - 1, 0)
        asked = np.concatenate([np.full((len(vectors), 1), index, np.float64), given], 1)
        expected = _rows(vectors.outputs.values(), room, 0)
        tables.append((asked, expected, _rows(vectors.tolerances.values(), room, LOOSE)))
    given, expected, allowed = (np.concatenate(parts) for parts in zip(*tables, strict=True))
    return SelfTest(given, expected, allowed, tuple(programs))


def _rows(arrays: Iterable[np.ndarray], width: int, rest: float) -> np.ndarray:
    """Arrays [N, ...] side by side, filled up to a width: [N, width]."""
    flat = [a.reshape(len(a), -1).astype(np.float64) for a in arrays]
    joined = np.concatenate(flat, 1)
    return np.pad(joined, ((0, 0), (0, width - joined.shape[1])), constant_values=rest)
